#pragma once

#include <opencv2/core/types.hpp>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Whether everything within `reach` px of (u, v) lies inside an image. Pixel p covers [p - 0.5, p + 0.5].
inline bool liesInside(double u, double v, double reach, cv::Size image) {
  return u - reach >= -0.5 && v - reach >= -0.5 && u + reach <= image.width - 0.5 && v + reach <= image.height - 0.5;
}

}  // namespace sdvo
