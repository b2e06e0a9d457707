#include "stereo_descriptor_vo/front_end/rig_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "block_search.hpp"

namespace sdvo {
namespace {

constexpr int kEnough = 25;  // corners found that a judgement needs: half of those that must be looked for

/// How the right image's rows lie against the left one's: dv by u, px.
struct Rows {
  double slope;    ///< median of the slopes between corners far apart
  double offset;   ///< median in the middle of the image, once the slope is taken away
  double scatter;  ///< median distance from that line
};

/// Each corner is compared with some of those before it.
Rows fitRows(const std::vector<FoundCorner>& found, int columns) {
  constexpr std::size_t kCompared = 100;  // with all, time would grow with the square of the corners
  std::vector<double> slopes, rest;
  for (std::size_t i = 0; i < found.size(); ++i)
    for (std::size_t k = 0; k < i; k += 1 + i / kCompared)
      if (std::abs(found[i].u - found[k].u) > 0.1 * columns)
        slopes.push_back((found[i].dv - found[k].dv) / (found[i].u - found[k].u));
  Rows rows{median(slopes), 0.0, 0.0};
  for (const FoundCorner& corner : found) rest.push_back(corner.dv - rows.slope * (corner.u - 0.5 * columns));
  rows.offset = median(rest);
  for (double& value : rest) value = std::abs(value - rows.offset);
  rows.scatter = median(rest);
  return rows;
}

/// Share of the corners that lie further right in the right image.
double swappedShare(const std::vector<FoundCorner>& found) {
  const auto swapped =
      std::count_if(found.begin(), found.end(), [](const FoundCorner& s) { return s.disparity < -1.0; });
  return static_cast<double>(swapped) / static_cast<double>(found.size());
}

/// Everything that would be said against the rig is far from being true, of so many corners that it is not by chance.
bool isClearlyInOrder(const std::vector<FoundCorner>& found, int columns, double max_dv) {
  constexpr std::size_t kEnoughToClear = 12;
  if (found.size() < kEnoughToClear || swappedShare(found) > 0.2) return false;
  const auto [slope, offset, scatter] = fitRows(found, columns);
  return std::max({scatter, std::abs(offset), 0.5 * columns * std::abs(slope)}) <= 0.5 * max_dv;
}

/// A tenth of the corners lie beyond the usual search: fewer may be wrong ones.
bool isTooNear(const std::vector<FoundCorner>& found, double max_disparity) {
  const auto near = std::count_if(found.begin(), found.end(),
                                  [&](const FoundCorner& corner) { return corner.disparity > max_disparity; });
  return 10 * near > static_cast<std::ptrdiff_t>(found.size());
}

}  // namespace

RigMonitor::RigMonitor(const RigMonitorOptions& options, double max_dv, double max_disparity)
    : options_(checked(options)), max_dv_(max_dv), max_disparity_(max_disparity) {}

bool RigMonitor::isSuspicious(int corners, int found) const {
  return corners >= kEnough && found < options_.suspicious_share * corners;
}

RigDiagnosis RigMonitor::diagnose(const cv::Mat& left, const cv::Mat& right,
                                  const std::vector<cv::Point2f>& corners) const {
  const BlockSearch search(left, right, std::max(max_disparity_, 0.5 * left.cols), kReach);
  std::vector<FoundCorner> found;
  constexpr std::size_t kMost = 120;  // corners: a millisecond
  const std::size_t step = (corners.size() + kMost - 1) / kMost;
  for (std::size_t i = 0; i < corners.size(); i += step) {
    const auto corner = search.find(corners[i]);
    if (!corner) continue;
    found.push_back(*corner);
    // A view with little to match is suspicious, too, pair after pair: a few corners clear its rig.
    constexpr std::size_t kAtOnce = 4;
    if (found.size() % kAtOnce == 0 && isClearlyInOrder(found, left.cols, max_dv_))
      return {{}, {}, isTooNear(found, max_disparity_)};
  }
  if (static_cast<int>(found.size()) < kEnough) return {};

  const auto [slope, offset, scatter] = fitRows(found, left.cols);
  if (scatter > std::max(max_dv_, 0.5 * std::abs(offset)))
    return {text(1, "rows of left and right differ by ", scatter,
                 " px here and there: not rectified, or not taken at the same moment?"),
            {},
            {}};
  if (swappedShare(found) > 0.6)
    return {
        "left and right images are swapped, or both are mirrored: corners lie further right in the right image, on "
        "their rows",
        {},
        {}};
  const RowLine rows{offset, slope, left.cols};
  if (std::abs(offset) > max_dv_)
    return {text(1, "right image ", std::abs(offset), " px too ", offset > 0.0 ? "low" : "high", ": not rectified?"),
            rows,
            {}};
  if (0.5 * left.cols * std::abs(slope) > 2.0 * max_dv_)
    return {text(1, "right image turned by ", std::abs(std::atan(slope)) * 180.0 / CV_PI, " degrees ",
                 slope > 0.0 ? "clockwise" : "counterclockwise", ": not rectified?"),
            rows,
            {}};
  return {{}, {}, isTooNear(found, max_disparity_)};
}

}  // namespace sdvo
