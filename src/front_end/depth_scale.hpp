#pragma once

#include "base_descriptor.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/options/feature_extractor_options.hpp"

namespace sdvo {

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
