#include "stereo_tracking.hpp"

#include <cmath>
#include <cstdint>
#include <opencv2/video/tracking.hpp>

namespace sdvo {

std::vector<StereoMatch> trackToRight(const cv::Mat& left, const cv::Mat& right,
                                      const std::vector<cv::Point2f>& left_positions,
                                      const StereoMatcherOptions& options) {
  const cv::Size kWindow(19, 19);     // px
  constexpr int kLevels = 4;          // above the image; each doubles the disparity reached
  constexpr float kMostApart = 0.5f;  // px, of a corner and where its track comes back
  constexpr int kLevelsBack = 1;      // the way back begins at the answer
  const cv::TermCriteria stop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.005);
  std::vector<StereoMatch> matches;
  if (left_positions.empty()) return matches;
  std::vector<cv::Point2f> right_positions, returned = left_positions;
  std::vector<std::uint8_t> found, found_back;
  cv::calcOpticalFlowPyrLK(left, right, left_positions, right_positions, found, cv::noArray(), kWindow, kLevels, stop);
  cv::calcOpticalFlowPyrLK(right, left, right_positions, returned, found_back, cv::noArray(), kWindow, kLevelsBack,
                           stop, cv::OPTFLOW_USE_INITIAL_FLOW);
  const cv::Rect2f inside(0.f, 0.f, static_cast<float>(right.cols - 1), static_cast<float>(right.rows - 1));
  for (std::size_t i = 0; i < left_positions.size(); ++i) {
    const cv::Point2f backward = returned[i] - left_positions[i], to_left = left_positions[i] - right_positions[i];
    const bool is_back = found[i] && found_back[i] && std::hypot(backward.x, backward.y) <= kMostApart;
    if (is_back && inside.contains(right_positions[i]) && to_left.x >= options.min_disparity &&
        std::abs(to_left.y) <= options.max_epipolar_residual)
      matches.push_back({static_cast<int>(i), to_left.x, -to_left.y});
  }
  return matches;
}

}  // namespace sdvo
