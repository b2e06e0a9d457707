#pragma once

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

namespace sdvo {

/// Where points went, to a fraction of a pixel; `guess` in, result out. Whether each was found.
inline std::vector<std::uint8_t> track(const cv::Mat& from, const cv::Mat& to, const std::vector<cv::Point2f>& points,
                                       std::vector<cv::Point2f>& guess, int levels) {
  std::vector<std::uint8_t> found;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(from, to, points, guess, found, error, cv::Size(13, 13), levels,
                           cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.01),
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  return found;
}

inline double distance(const cv::Point2f& a, const cv::Point2f& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

}  // namespace sdvo
