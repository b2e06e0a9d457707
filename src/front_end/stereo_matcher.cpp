#include "stereo_descriptor_vo/front_end/stereo_matcher.hpp"

#include <opencv2/core/utility.hpp>
#include <stdexcept>

namespace sdvo {

void StereoMatcherOptions::check() const {
  if (min_disparity >= epipolar.max_disparity)
    throw std::invalid_argument(
        "min_disparity is not below epipolar/max_disparity: no disparity is left, lower the first or raise the second");
}

StereoMatcher::StereoMatcher(const StereoMatcherOptions& options) : options_(checked(options)) {}

std::vector<StereoMatch> StereoMatcher::match(const cv::Mat& left, const cv::Mat& right,
                                              const std::vector<cv::Point2f>& left_positions,
                                              std::optional<double> max_disparity) const {
  if (left_positions.empty()) return {};
  thread_local EpipolarMatcher::Images scratch;
  EpipolarMatcherOptions epipolar = options_.epipolar;
  epipolar.max_disparity = max_disparity.value_or(epipolar.max_disparity);
  const EpipolarMatcher matcher(epipolar, options_.max_epipolar_residual, left, right, scratch);
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

}  // namespace sdvo
