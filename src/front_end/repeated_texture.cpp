#include "repeated_texture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "../common/statistics.hpp"
#include "../common/text.hpp"

namespace sdvo {
namespace {

/// Whether the texture in view repeats: a sequential test (Wald 1945) of matches with a rival, spread over the list.
/// The ratio of these that have a period is 0.05 to 0.16 by chance, and nearly one where texture repeats.
bool isRepeated(const std::vector<std::size_t>& with_rival, const PeriodOf& periodOf) {
  // The test decides between ratios of 0.15 and 0.6, where a period has twice the log-odds of none. One view in 4,000
  // is wrong at 0.15.
  constexpr int kPeriod = 2, kNone = -1, kUnique = -3, kRepeated = 12;
  constexpr std::size_t kMost = 24;
  int evidence = 0;
  for (std::size_t k = 0; k < std::min(kMost, with_rival.size()) && evidence > kUnique && evidence < kRepeated; ++k) {
    constexpr double kGolden = 0.618034;  // multiples of it modulo 1 spread evenly, however many
    const double turns = kGolden * static_cast<double>(k), count = static_cast<double>(with_rival.size());
    evidence +=
        periodOf(with_rival[static_cast<std::size_t>((turns - std::floor(turns)) * count)]) > 0.f ? kPeriod : kNone;
  }
  return evidence >= kRepeated;
}

/// Takes the period from matches whose disparity the nearest unique ones share: a surface that repeats has dirt and
/// edges that do not.
void confirmByUnique(const std::vector<cv::Point2f>& left_positions, const std::vector<std::size_t>& with_rival,
                     std::vector<StereoMatch>& matches) {
  constexpr std::size_t kFewest = 5, kNearest = 8;  // unique matches (chosen)
  constexpr double kLikeNeighbours = 0.75;          // ratio of the nearest (chosen)
  constexpr float kTolerance = 0.125f;              // periods: a quarter of other surfaces agree by chance
  std::vector<StereoMatch> unique;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (matches[i].period == 0.f && !std::binary_search(with_rival.begin(), with_rival.end(), i))
      unique.push_back(matches[i]);
  if (unique.size() < kFewest) return;
  const std::size_t count = std::min(kNearest, unique.size());
  for (StereoMatch& match : matches) {
    if (match.period == 0.f) continue;
    const auto distance = [&](const StereoMatch& other) {
      const cv::Point2f apart = left_positions[other.left_index] - left_positions[match.left_index];
      return apart.dot(apart);
    };
    std::nth_element(unique.begin(), unique.begin() + static_cast<std::ptrdiff_t>(count - 1), unique.end(),
                     [&](const StereoMatch& a, const StereoMatch& b) { return distance(a) < distance(b); });
    const auto agreeing = std::count_if(
        unique.begin(), unique.begin() + static_cast<std::ptrdiff_t>(count), [&](const StereoMatch& other) {
          return std::abs(other.disparity - match.disparity) < kTolerance * match.period;
        });
    if (static_cast<double>(agreeing) >= kLikeNeighbours * static_cast<double>(count)) match.period = 0.f;
  }
}

}  // namespace

void markRepeated(const std::vector<cv::Point2f>& left_positions, const std::vector<std::size_t>& with_rival,
                  const PeriodOf& periodOf, std::vector<StereoMatch>& matches) {
  if (!isRepeated(with_rival, periodOf)) return;
  cv::parallel_for_(cv::Range(0, static_cast<int>(matches.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) matches[i].period = periodOf(static_cast<std::size_t>(i));
  });
  confirmByUnique(left_positions, with_rival, matches);
}

std::string removeRepeated(std::vector<StereoMatch>& matches, const StereoCamera& camera, double max_disparity) {
  std::vector<double> periods;
  for (const StereoMatch& match : matches)
    if (match.period > 0.f) periods.push_back(match.period);
  const std::size_t all = matches.size();
  const auto repeats = [](const StereoMatch& match) { return match.period > 0.f; };
  matches.erase(std::remove_if(matches.begin(), matches.end(), repeats), matches.end());
  if (2 * periods.size() <= all) return "";
  const double period = median(periods);
  return text(0, periods.size(), " of ", all, " matches are of texture that repeats every ", period,
              " px along the row, so their disparity may be a period off: if nothing is nearer than ") +
         text(2, camera.fx * camera.baseline / period, " m, set stereo/epipolar/max_disparity (") +
         text(0, max_disparity, ") below ", period);
}

}  // namespace sdvo
