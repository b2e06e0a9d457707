#include "repeated_texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "../common/statistics.hpp"
#include "../common/text.hpp"

namespace sdvo {
namespace {

/// Whether the texture in view repeats: a sequential test (Wald 1945) of matches with a rival, spread over the list.
/// The ratio of these that have a period is 0.05 to 0.16 by chance, and nearly one where texture repeats.
bool isRepeated(const std::vector<Rival>& rivals, const PeriodOf& periodOf) {
  // The test decides between ratios of 0.15 and 0.6, where a period has twice the log-odds of none. One view in 4,000
  // is wrong at 0.15.
  constexpr int kPeriod = 2, kNone = -1, kUnique = -3, kRepeated = 12;
  constexpr std::size_t kMost = 24;
  int evidence = 0;
  for (std::size_t k = 0; k < std::min(kMost, rivals.size()) && evidence > kUnique && evidence < kRepeated; ++k) {
    constexpr double kGolden = 0.618034;  // multiples of it modulo 1 spread evenly, however many
    const double turns = kGolden * static_cast<double>(k), count = static_cast<double>(rivals.size());
    const Rival& rival = rivals[static_cast<std::size_t>((turns - std::floor(turns)) * count)];
    evidence += periodOf(rival.match) > 0.f ? kPeriod : kNone;
  }
  return evidence >= kRepeated;
}

/// Some matches in the order of their rows, which finds the nearest ones without a look at all.
class Neighbours {
 public:
  static constexpr std::size_t kMost = 8;  // so many decide on a match (chosen)
  struct Nearest {
    std::array<std::pair<float, const StereoMatch*>, kMost>
        found;  ///< ascending squares of distances, px², and matches
    std::size_t count = 0;
  };

  Neighbours(const std::vector<cv::Point2f>& left_positions, std::vector<StereoMatch> matches)
      : left_positions_(left_positions), matches_(std::move(matches)) {
    std::stable_sort(matches_.begin(), matches_.end(),
                     [&](const StereoMatch& a, const StereoMatch& b) { return positionOf(a).y < positionOf(b).y; });
  }

  Nearest nearestTo(const StereoMatch& match) const {
    const cv::Point2f place = positionOf(match);
    auto below = std::lower_bound(matches_.begin(), matches_.end(), place.y,
                                  [&](const StereoMatch& other, float y) { return positionOf(other).y < y; });
    auto above = below;
    Nearest nearest;
    while (above != matches_.begin() || below != matches_.end()) {
      const float up = above != matches_.begin() ? place.y - positionOf(*(above - 1)).y : kNone;
      const float down = below != matches_.end() ? positionOf(*below).y - place.y : kNone;
      const float rows = std::min(up, down);
      if (nearest.count == kMost && rows * rows >= nearest.found.back().first) break;
      insert(up < down ? *--above : *below++, place, nearest);
    }
    return nearest;
  }

 private:
  static constexpr float kNone = std::numeric_limits<float>::infinity();

  const cv::Point2f& positionOf(const StereoMatch& match) const {
    return left_positions_[static_cast<std::size_t>(match.left_index)];
  }

  void insert(const StereoMatch& match, const cv::Point2f& place, Nearest& nearest) const {
    const cv::Point2f apart = positionOf(match) - place;
    const float square = apart.dot(apart);
    if (nearest.count < kMost)
      ++nearest.count;
    else if (square >= nearest.found.back().first)
      return;
    std::size_t k = nearest.count - 1;
    for (; k > 0 && nearest.found[k - 1].first > square; --k) nearest.found[k] = nearest.found[k - 1];
    nearest.found[k] = {square, &match};
  }

  const std::vector<cv::Point2f>& left_positions_;
  std::vector<StereoMatch> matches_;
};

/// Gives a unique match a period where most around have one below its disparity. Two surfaces that repeat, such as
/// balusters before stairs, match best where whole periods of both make up for the distance between them; nothing else
/// resembles that block.
void doubtCoincidences(const std::vector<cv::Point2f>& left_positions, std::vector<StereoMatch>& matches) {
  float least = std::numeric_limits<float>::infinity();
  for (const StereoMatch& match : matches)
    if (match.period > 0.f) least = std::min(least, match.period);
  const Neighbours neighbours(left_positions, matches);
  for (StereoMatch& match : matches) {
    if (match.period > 0.f || match.disparity <= least) continue;
    const Neighbours::Nearest nearest = neighbours.nearestTo(match);
    std::vector<double> periods;
    for (std::size_t k = 0; k < nearest.count; ++k)
      if (nearest.found[k].second->period > 0.f) periods.push_back(nearest.found[k].second->period);
    if (2 * periods.size() <= nearest.count) continue;
    const double period = median(periods);
    if (match.disparity > period) match.period = static_cast<float>(period);
  }
}

/// Takes the period from matches whose disparity the nearest unique ones share: a surface that repeats has dirt and
/// edges that do not.
void confirmByUnique(const std::vector<cv::Point2f>& left_positions, std::vector<StereoMatch>& matches) {
  constexpr std::size_t kFewest = 5;        // unique matches (chosen)
  constexpr double kLikeNeighbours = 0.75;  // ratio of the nearest (chosen)
  constexpr float kTolerance = 0.125f;      // periods: a quarter of other surfaces agree by chance
  std::vector<StereoMatch> unique;
  std::copy_if(matches.begin(), matches.end(), std::back_inserter(unique),
               [](const StereoMatch& match) { return match.period == 0.f; });
  if (unique.size() < kFewest) return;
  const Neighbours neighbours(left_positions, std::move(unique));
  for (StereoMatch& match : matches) {
    if (match.period == 0.f) continue;
    const Neighbours::Nearest nearest = neighbours.nearestTo(match);
    std::size_t agreeing = 0;
    for (std::size_t k = 0; k < nearest.count; ++k)
      agreeing += std::abs(nearest.found[k].second->disparity - match.disparity) < kTolerance * match.period;
    if (static_cast<double>(agreeing) >= kLikeNeighbours * static_cast<double>(nearest.count)) match.period = 0.f;
  }
}

}  // namespace

void markRepeated(const std::vector<cv::Point2f>& left_positions, const std::vector<Rival>& rivals,
                  const PeriodOf& periodOf, std::vector<StereoMatch>& matches) {
  if (!isRepeated(rivals, periodOf)) return;
  cv::parallel_for_(cv::Range(0, static_cast<int>(matches.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) matches[i].period = periodOf(static_cast<std::size_t>(i));
  });
  // A block of two surfaces has rivals, though neither period is its own.
  for (const Rival& rival : rivals)
    if (float& period = matches[rival.match].period; period == 0.f) period = rival.distance;
  doubtCoincidences(left_positions, matches);
  confirmByUnique(left_positions, matches);
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
