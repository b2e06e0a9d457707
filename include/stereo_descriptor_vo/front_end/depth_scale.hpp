#pragma once

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/front_end/base_descriptor.hpp"

namespace sdvo {

/// Size of a feature's neighbourhood from its stereo depth (paper, section 4.1). A circle of fixed size in the world
/// has an image radius proportional to 1/Z, that is to the disparity; in disparity the curve is the same for every rig.
/// Slope and limits of 0 are those of the base descriptor, see completedFor().
struct DepthScaleOptions {
  bool scale_normalisation = true;  ///< false: every feature has constant_size, which the lab compares with
  double slope = 0.0;
  double exponent = 1.0;
  double offset = 0.0;
  double min_size = 0.0;
  double max_size = 0.0;
  double constant_size = BaseDescriptor::kStandardSize;  ///< px

  void describe(OptionList& list) {
    list.add("slope", slope, {0.0, 100.0}, "px", "a in size = a * disparity^b + c; 0: the one of descriptor/type");
    list.add("exponent", exponent, {0.1, 3.0}, "", "b in size = a * disparity^b + c; 1: a fixed circle in the world");
    list.add("offset", offset, {-100.0, 100.0}, "px", "c in size = a * disparity^b + c");
    list.add("min_size", min_size, {0.0, 200.0}, "px",
             "smallest key point diameter, at least 2 px; 0: the one of descriptor/type");
    list.add("max_size", max_size, {0.0, 400.0}, "px",
             "largest key point diameter, at least min_size; 0: the one of descriptor/type");
  }

  /// The same with the base descriptor's own slope and limits in place of zeros. A descriptor that depth does not help
  /// has its standard size as both limits.
  DepthScaleOptions completedFor(DescriptorType type) const;
};

class DepthScale {
 public:
  /// Throws std::invalid_argument when an option is out of its range, min_size is below 2 px or exceeds max_size, or a
  /// zero was not completed.
  explicit DepthScale(const DepthScaleOptions& options);

  /// Key point diameter in px for a disparity in px.
  double size(double disparity) const;

 private:
  DepthScaleOptions options_;
};

}  // namespace sdvo
