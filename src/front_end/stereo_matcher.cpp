#include "stereo_descriptor_vo/front_end/stereo_matcher.hpp"

#include <cstdint>
#include <opencv2/core/utility.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>
#include <stdexcept>

namespace sdvo {

void StereoMatcherOptions::check() const {
  if (method == StereoMethod::kEpipolar && min_disparity >= epipolar.max_disparity)
    throw std::invalid_argument(
        "min_disparity is not below epipolar/max_disparity: no disparity is left, lower the first or raise the second");
}

StereoMatcher::StereoMatcher(const StereoMatcherOptions& options) : options_(checked(options)) {}

std::vector<StereoMatch> StereoMatcher::match(const cv::Mat& left, const cv::Mat& right,
                                              const std::vector<cv::Point2f>& left_positions) const {
  if (left_positions.empty()) return {};
  return options_.method == StereoMethod::kLucasKanade ? track(left, right, left_positions)
                                                       : search(left, right, left_positions);
}

std::vector<StereoMatch> StereoMatcher::search(const cv::Mat& left, const cv::Mat& right,
                                               const std::vector<cv::Point2f>& left_positions) const {
  thread_local EpipolarMatcher::Images scratch;
  const EpipolarMatcher matcher(options_.epipolar, options_.max_epipolar_residual, left, right, scratch);
  std::vector<std::optional<cv::Point2f>> found(left_positions.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(found.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) found[i] = matcher.find(left_positions[i]);
  });
  std::vector<StereoMatch> matches;
  matches.reserve(found.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    if (found[i] && isTrusted(found[i]->x, found[i]->y))
      matches.push_back({static_cast<int>(i), found[i]->x, found[i]->y});
  return matches;
}

std::vector<StereoMatch> StereoMatcher::track(const cv::Mat& left, const cv::Mat& right,
                                              const std::vector<cv::Point2f>& left_positions) const {
  std::vector<StereoMatch> matches;
  const int side = 2 * options_.window_radius + 1;
  const cv::Size window(side, side);
  const cv::TermCriteria stop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.005);
  std::vector<cv::Mat> left_pyramid, right_pyramid;
  const int levels = cv::buildOpticalFlowPyramid(left, left_pyramid, window, options_.pyramid_levels);
  cv::buildOpticalFlowPyramid(right, right_pyramid, window, levels);

  std::vector<cv::Point2f> right_positions, returned = left_positions;
  std::vector<std::uint8_t> found, found_back;
  cv::calcOpticalFlowPyrLK(left_pyramid, right_pyramid, left_positions, right_positions, found, cv::noArray(), window,
                           levels, stop);
  // The way back starts from the answer, so that two levels are enough to see whether both agree.
  cv::calcOpticalFlowPyrLK(right_pyramid, left_pyramid, right_positions, returned, found_back, cv::noArray(), window, 1,
                           stop, cv::OPTFLOW_USE_INITIAL_FLOW);

  const cv::Rect2f inside(0.f, 0.f, static_cast<float>(right.cols - 1), static_cast<float>(right.rows - 1));
  for (std::size_t i = 0; i < left_positions.size(); ++i) {
    if (!found[i] || !found_back[i] || !inside.contains(right_positions[i])) continue;
    const cv::Point2f backward = returned[i] - left_positions[i];
    if (std::hypot(backward.x, backward.y) > options_.max_backward_error) continue;
    const float disparity = left_positions[i].x - right_positions[i].x;
    const float dv = right_positions[i].y - left_positions[i].y;
    if (isTrusted(disparity, dv)) matches.push_back({static_cast<int>(i), disparity, dv});
  }
  return matches;
}

}  // namespace sdvo
