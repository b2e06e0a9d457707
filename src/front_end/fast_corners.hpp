#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace sdvo {

/// FAST corners of nine contiguous pixels (Rosten and Drummond 2006) of a CV_8U image: those of cv::FAST with
/// non-maximum suppression, scores included, at half of its time.
std::vector<cv::KeyPoint> findFastCorners(const cv::Mat& image, int threshold);

/// Sub-pixel offset, px, of a FAST corner from its `pixel` in a CV_8U image: the maxima of two parabolas through the
/// contrasts of the pixel and its neighbours, along x and along y. A contrast is the largest difference to the centre
/// that all nine pixels of an arc have, brighter or darker. The offset is at most one pixel along each axis. It is zero
/// where the contrast has no maximum, and where the circles of the eight neighbours leave the image.
///
/// These positions are far more repeatable than the intersections of gradient lines (cv::cornerSubPix): many of FAST's
/// corners are spots, which have no such intersection (docs/decisions.md).
cv::Point2f cornerPeak(const cv::Mat& image, const cv::Point& pixel);

}  // namespace sdvo
