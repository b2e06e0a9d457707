#pragma once

#include <opencv2/core.hpp>

namespace sdvo {

/// Where a FAST corner at `pixel` of a CV_8U image lies between the pixels: the offset, px, to the maximum of two
/// parabolas through the contrasts of its neighbourhood (the difference to the centre that nine pixels in a row of the
/// circle exceed), one along x and one along y. At most one pixel along each axis; zero where the contrast has no
/// maximum and where the circles of its eight neighbours leave the image.
///
/// That is far more repeatable than the intersection of the gradient lines (cv::cornerSubPix), which wanders off from
/// the many of FAST's corners that are spots and no corners (docs/log/accuracy.md).
cv::Point2f cornerPeak(const cv::Mat& image, const cv::Point& pixel);

}  // namespace sdvo
