#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo::render {

/// What a real camera does to the light, each with a range; all are the same for both cameras of a pair except noise.
struct CameraEffects {
  double noise = 1.5;            ///< standard deviation, grey levels
  double exposure = 0.0;         ///< slow change of the gain, ± fraction
  double exposure_period = 8.0;  ///< of that change, s
  double vignetting = 0.0;       ///< loss of light in the corners, fraction
  double defocus = 0.6;          ///< standard deviation of the blur, px; KITTI's images have about this much
  double motion_blur = 0.0;      ///< exposure time, s; the stamp is its middle

  void describe(OptionList& list);

  /// Gain of a frame taken at `time` (s): 1 on average.
  double gain(double time, std::uint64_t seed) const;
  /// From brightness (1 = white) to 8 bit. `stream` tells images apart: equal for equal images only.
  cv::Mat1b apply(const cv::Mat1f& brightness, double time, std::uint64_t seed, std::uint64_t stream) const;
};

}  // namespace sdvo::render
