#include "stereo_matcher.hpp"

#include <cmath>
#include <opencv2/core/utility.hpp>
#include <stdexcept>

#include "epipolar_search.hpp"
#include "image_noise.hpp"
#include "repeated_texture.hpp"

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
  thread_local SearchedImages images;  // keep their memory: to get it anew from the system is slow
  images.take(left, right);
  const double most = max_disparity.value_or(options_.epipolar.max_disparity);
  const EpipolarSearch search(options_, most, noiseOf(left), images);
  std::vector<std::optional<EpipolarSearch::Found>> found(left_positions.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(found.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) found[i] = search.find(left_positions[i]);
  });
  std::vector<StereoMatch> matches;
  matches.reserve(found.size());
  std::vector<Rival> rivals;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!found[i]) continue;
    const auto& [place, rival] = *found[i];
    if (place.x < options_.min_disparity || std::abs(place.y) > options_.max_epipolar_residual) continue;
    matches.push_back({static_cast<int>(i), place.x, place.y});
    if (rival > 0.f) rivals.push_back({matches.size() - 1, rival});
  }
  const auto periodOf = [&](std::size_t i) {
    return search.findPeriod(left_positions[static_cast<std::size_t>(matches[i].left_index)], matches[i].disparity);
  };
  markRepeated(left_positions, rivals, periodOf, matches);
  return matches;
}

}  // namespace sdvo
