#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace sdvo {

/// FAST corners of nine contiguous pixels (Rosten and Drummond 2006) of a CV_8U image: those of cv::FAST with
/// non-maximum suppression, scores included, at half of its time.
std::vector<cv::KeyPoint> findFastCorners(const cv::Mat& image, int threshold);

/// Offset, px, from `pixel` to the place of its FAST corner between the pixels of a CV_8U image. It is the maximum of
/// two parabolas through the contrasts of the neighbourhood, one along x and one along y. A contrast is the difference
/// to the centre that nine pixels in a row of the circle exceed. The offset is at most one pixel along each axis. It is
/// zero where the contrast has no maximum, and where the circles of the eight neighbours leave the image.
///
/// Such corners are far more repeatable than those of cv::cornerSubPix, the intersection of gradient lines. Many of
/// FAST's corners are spots, from which that wanders off (docs/decisions.md).
cv::Point2f cornerPeak(const cv::Mat& image, const cv::Point& pixel);

}  // namespace sdvo
