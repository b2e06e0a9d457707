#include "stereo_descriptor_vo/front_end/rig_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <sstream>

#include "../common/median.hpp"

namespace sdvo {
namespace {

constexpr int kEnough = 25;  // corners found that a judgement needs: half of those that must be looked for

/// A corner of the left image and where it is in the right one.
struct Sighting {
  double u;  ///< px from the middle of the left image
  double disparity, dv;
};

/// Where the block around `centre` looks most alike within `area`, a rectangle of block centres. Nothing where the best
/// correlation lacks more of 1 than `uniqueness` times what the best one elsewhere lacks: texture that repeats itself,
/// or a point whose true match lies outside of the area.
std::optional<cv::Point> findBlock(const cv::Mat& from, const cv::Mat& in, cv::Point centre, cv::Size half,
                                   cv::Rect area, double uniqueness) {
  constexpr double kAlike = 0.85;  // least correlation
  constexpr double kFlat = 3.0;    // grey levels; the correlation of flat blocks means nothing
  constexpr int kSame = 2;         // px around the best that count as the same place
  const cv::Rect block(centre.x - half.width, centre.y - half.height, 2 * half.width + 1, 2 * half.height + 1);
  const cv::Rect whole(0, 0, from.cols, from.rows);
  const cv::Rect reach =
      cv::Rect(area.x - half.width, area.y - half.height, area.width + 2 * half.width, area.height + 2 * half.height) &
      whole;
  if ((block & whole) != block || reach.width < block.width || reach.height < block.height) return std::nullopt;
  cv::Scalar mean, deviation;
  cv::meanStdDev(from(block), mean, deviation);
  if (deviation[0] < kFlat) return std::nullopt;
  cv::Mat correlation;
  cv::matchTemplate(in(reach), from(block), correlation, cv::TM_CCOEFF_NORMED);
  double best = 0.0, elsewhere = 0.0;
  cv::Point at;
  cv::minMaxLoc(correlation, nullptr, &best, nullptr, &at);
  if (!(best >= kAlike)) return std::nullopt;
  const cv::Rect same(at.x - kSame, at.y - kSame, 2 * kSame + 1, 2 * kSame + 1);
  correlation(same & cv::Rect(0, 0, correlation.cols, correlation.rows)).setTo(-1.0);
  cv::minMaxLoc(correlation, nullptr, &elsewhere);
  if (1.0 - best > uniqueness * (1.0 - elsewhere)) return std::nullopt;
  return cv::Point(reach.x + at.x + half.width, reach.y + at.y + half.height);
}

/// The same where the way back leads to where it began.
std::optional<cv::Point> findMutually(const cv::Mat& left, const cv::Mat& right, cv::Point centre, cv::Size half,
                                      cv::Size reach) {
  constexpr double kUnique = 0.7;
  const auto around = [&](cv::Point middle) {
    return cv::Rect(middle.x - reach.width, middle.y - reach.height, 2 * reach.width + 1, 2 * reach.height + 1);
  };
  const auto there = findBlock(left, right, centre, half, around(centre), kUnique);
  if (!there) return std::nullopt;
  const auto back = findBlock(right, left, *there, half, around(*there), kUnique);
  if (!back || std::max(std::abs(back->x - centre.x), std::abs(back->y - centre.y)) > 1) return std::nullopt;
  return there;
}

void quarter(const cv::Mat& image, cv::Mat& small) {
  cv::resize(image, small, cv::Size(image.cols / 4, image.rows / 4), 0.0, 0.0, cv::INTER_AREA);
}

/// How the right image's rows lie against the left one's: dv by u, px.
struct Rows {
  double slope, offset;  ///< of the line through the medians, by the median of slopes between corners far apart
  double scatter;        ///< median distance from that line
};

Rows fitRows(const std::vector<Sighting>& sightings, int columns) {
  std::vector<double> slopes, rest;
  for (std::size_t i = 0; i < sightings.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (std::abs(sightings[i].u - sightings[k].u) > 0.1 * columns)
        slopes.push_back((sightings[i].dv - sightings[k].dv) / (sightings[i].u - sightings[k].u));
  Rows rows{median(slopes), 0.0, 0.0};
  for (const Sighting& sighting : sightings) rest.push_back(sighting.dv - rows.slope * sighting.u);
  rows.offset = median(rest);
  for (double& value : rest) value = std::abs(value - rows.offset);
  rows.scatter = median(rest);
  return rows;
}

/// Share of the corners that lie further right in the right image.
double swappedShare(const std::vector<Sighting>& sightings) {
  const auto swapped =
      std::count_if(sightings.begin(), sightings.end(), [](const Sighting& s) { return s.disparity < -1.0; });
  return static_cast<double>(swapped) / static_cast<double>(sightings.size());
}

/// Everything that would be said against the rig is far from being true, of so many corners that it is not by chance.
bool isClearlyInOrder(const std::vector<Sighting>& sightings, int columns, double max_dv) {
  constexpr std::size_t kEnoughToClear = 12;
  if (sightings.size() < kEnoughToClear || swappedShare(sightings) > 0.2) return false;
  const auto [slope, offset, scatter] = fitRows(sightings, columns);
  return std::max({scatter, std::abs(offset), 0.5 * columns * std::abs(slope)}) <= 0.5 * max_dv;
}

template <class... Parts>
std::string sentence(const Parts&... parts) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1);
  (text << ... << parts);
  return text.str();
}

}  // namespace

RigMonitor::RigMonitor(const RigMonitorOptions& options, double max_dv, double max_disparity)
    : options_(checked(options)), max_dv_(max_dv), max_disparity_(max_disparity) {}

bool RigMonitor::isSuspicious(int corners, int found) const {
  return options_.enabled && corners >= kEnough && found < options_.suspicious_share * corners;
}

std::string RigMonitor::diagnose(const cv::Mat& left, const cv::Mat& right,
                                 const std::vector<cv::Point2f>& corners) const {
  cv::Mat small_left, small_right;
  quarter(left, small_left);
  quarter(right, small_right);
  const int columns = static_cast<int>(std::ceil(0.25 * max_disparity_));
  const int rows = static_cast<int>(std::ceil(0.25 * options_.reach));
  std::vector<Sighting> sightings;
  const std::size_t most = static_cast<std::size_t>(options_.corners), step = (corners.size() + most - 1) / most;
  for (std::size_t i = 0; i < corners.size(); i += step) {
    // Coarsely in all directions, swapped sides included, then around that to a pixel.
    const cv::Point small(cvRound(0.25f * corners[i].x - 0.375f), cvRound(0.25f * corners[i].y - 0.375f));
    const auto coarse = findMutually(small_left, small_right, small, {5, 4}, {columns, rows});
    if (!coarse) continue;
    const cv::Point centre(cvRound(corners[i].x), cvRound(corners[i].y));
    const cv::Point guess = centre + 4 * (*coarse - small);
    const auto fine = findBlock(left, right, centre, {7, 7}, {guess.x - 4, guess.y - 4, 9, 9}, 1.0);
    if (!fine) continue;
    sightings.push_back(
        {centre.x - 0.5 * left.cols, static_cast<double>(centre.x - fine->x), static_cast<double>(fine->y - centre.y)});
    // A view with little to match is suspicious, too, pair after pair: a few corners clear its rig.
    constexpr std::size_t kAtOnce = 4;
    if (sightings.size() % kAtOnce == 0 && isClearlyInOrder(sightings, left.cols, max_dv_)) return "";
  }
  if (static_cast<int>(sightings.size()) < kEnough) return "";

  if (swappedShare(sightings) > 0.6)
    return "left and right images are swapped? Corners lie further right in the right image";
  const auto [slope, offset, scatter] = fitRows(sightings, left.cols);
  if (scatter > std::max(max_dv_, 0.5 * std::abs(offset)))
    return sentence("rows of left and right differ by ", scatter,
                    " px here and there: not rectified, or not taken at the same moment?");
  if (std::abs(offset) > max_dv_)
    return sentence("right image ", std::abs(offset), " px too ", offset > 0.0 ? "low" : "high", ": not rectified?");
  if (0.5 * left.cols * std::abs(slope) > 2.0 * max_dv_)
    return sentence("right image turned by ", std::abs(std::atan(slope)) * 180.0 / CV_PI, " degrees ",
                    slope > 0.0 ? "clockwise" : "counterclockwise", ": not rectified?");
  return "";
}

}  // namespace sdvo
