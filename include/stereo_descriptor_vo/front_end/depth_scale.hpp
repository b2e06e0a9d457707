#pragma once

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

/// Size of a feature's neighbourhood from its stereo depth (paper, section 4.1). A circle of fixed size in the world
/// has an image radius proportional to 1/Z, that is to the disparity; in disparity the curve is the same for every rig.
struct DepthScaleOptions {
  bool scale_normalisation = true;
  double slope = 0.72;
  double exponent = 1.0;
  double offset = 0.0;
  double min_size = 4.0;
  double max_size = 32.0;
  double constant_size = 7.0;

  void describe(OptionList& list) {
    list.add("scale_normalisation", scale_normalisation,
             "size follows disparity; false: every feature has constant_size");
    list.add("slope", slope, {0.0, 100.0}, "px", "a in size = a * disparity^b + c");
    list.add("exponent", exponent, {0.1, 3.0}, "", "b in size = a * disparity^b + c; 1: a fixed circle in the world");
    list.add("offset", offset, {-100.0, 100.0}, "px", "c in size = a * disparity^b + c");
    list.add("min_size", min_size, {2.0, 200.0}, "px", "smallest key point diameter");
    list.add("max_size", max_size, {2.0, 400.0}, "px", "largest key point diameter");
    list.add("constant_size", constant_size, {2.0, 200.0}, "px", "diameter without scale normalisation");
  }
  /// Throws std::invalid_argument when min_size exceeds max_size.
  void check() const;
};

class DepthScale {
 public:
  /// Throws std::invalid_argument when an option is out of its range or min_size exceeds max_size.
  explicit DepthScale(const DepthScaleOptions& options);

  /// Key point diameter in px for a disparity in px.
  double size(double disparity) const;

 private:
  DepthScaleOptions options_;
};

}  // namespace sdvo
