#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo {

/// A rectified pair of a recording.
struct RecordedPair {
  StereoCamera camera;
  cv::Mat left, right;      ///< CV_8U grey; valid as long as the call that it is given to
  std::int64_t stamp;       ///< ns
  std::string lens;         ///< the calibration's model in words; empty: unknown
  std::string unrectified;  ///< evidence that the images are not rectified; empty: none
  double right_delay = 0.0;  ///< s, of the right image by its stamp, where approximate_sync pairs them
};

}  // namespace sdvo
