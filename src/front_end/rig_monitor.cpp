#include "rig_monitor.hpp"

#include <algorithm>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "block_search.hpp"
#include "image_noise.hpp"

namespace sdvo {
namespace {

constexpr int kEnough = 25;    // corners (chosen): detected ones for a suspicion, found ones for a judgement
constexpr int kAgreeing = 12;  // corners on one line of rows: a wrong match lies there with a probability of 6 %

double distanceFrom(const RowLine& rows, const FoundCorner& corner) {
  return std::abs(corner.dv - rows.at(corner.u));
}

/// The slope is the median over pairs of corners that are far apart (Theil-Sen), the offset the median of the rest.
/// Each corner is paired with some of the previous ones.
RowLine fitRows(const std::vector<FoundCorner>& found, int columns) {
  constexpr std::size_t kCompared = 100;  // with all, time would grow with the square of the corners
  std::vector<double> slopes, rest;
  std::size_t compared = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    for (std::size_t k = 0; k < i; k += 1 + i / kCompared, ++compared)
      if (std::abs(found[i].u - found[k].u) > 0.1 * columns)
        slopes.push_back((found[i].dv - found[k].dv) / (found[i].u - found[k].u));
  // If nearly all corners are close together, most pairs that are far apart contain an outlier: no slope is measured.
  if (4 * slopes.size() < compared) slopes.clear();
  RowLine rows{0.0, median(slopes), columns};
  for (const FoundCorner& corner : found) rest.push_back(corner.dv - rows.at(corner.u));
  rows.offset = median(rest);
  return rows;
}

/// Corners within `max_dv` of the rows, by the sign of their disparity: positive, and negative as of swapped images.
struct Agreement {
  int in_order = 0, swapped = 0;
};
Agreement agreementWith(const RowLine& rows, const std::vector<FoundCorner>& found, double max_dv) {
  Agreement agreement;
  for (const FoundCorner& corner : found)
    if (distanceFrom(rows, corner) <= max_dv) ++(corner.disparity < -1.0 ? agreement.swapped : agreement.in_order);
  return agreement;
}

/// A cause that was tried, and how many of the corners it explains.
struct Cause {
  int corners;
  RigDiagnosis diagnosis;
};

RigDiagnosis refusal(const std::string& words, const std::optional<RowLine>& rows = std::nullopt) {
  return {words, rows, false, true};
}

/// Diagnosis of a rig in order. The scene is too near if a tenth of the corners have larger disparities than the search
/// reaches; fewer may be wrong matches.
RigDiagnosis inOrder(const std::vector<FoundCorner>& found, int columns, double max_disparity) {
  const auto shareBeyond = [&](double most) {
    const auto is = [&](const FoundCorner& corner) { return corner.disparity > most; };
    return static_cast<double>(std::count_if(found.begin(), found.end(), is)) / static_cast<double>(found.size());
  };
  const bool is_half = shareBeyond(0.5 * columns) > 0.5;
  return {
      is_half ? "too near: disparities beyond half of the image's width" : "", {}, shareBeyond(max_disparity) > 0.1};
}

/// Hypothesis: one side is flipped; `code` as of cv::flip. Swapped sides with the other image flipped look the same.
Cause tryFlip(int code, const char* how, const cv::Mat& left, const cv::Mat& right,
              const std::vector<cv::Point2f>& corners, double max_dv) {
  cv::Mat flipped;
  cv::flip(right, flipped, code);
  const BlockSearch search(left, flipped, left.cols, RigMonitor::kReach);
  std::vector<FoundCorner> found;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    // If the image is flipped, at least a fifth of the corners are found; otherwise a fiftieth. So 3 of 24 decide.
    if (i == 24 && found.size() < 3) break;
    if (const auto corner = search.find(corners[i])) found.push_back(*corner);
  }
  const auto [in_order, swapped] = agreementWith(fitRows(found, left.cols), found, max_dv);
  const bool is_right = in_order > swapped;
  return {std::max(in_order, swapped),
          refusal(text(0, "either the ", is_right ? "right" : "left", " image is ", how, ", or the ",
                       is_right ? "left" : "right", " one is and both are swapped"))};
}

/// Faults of a single side: its gradients, less those of noise, are much smaller than the other side's, or it repeats
/// the image of the previous pair. Sums over so many pixels are not equal by chance.
RigDiagnosis judgeSides(const cv::Mat& left, const cv::Mat& right, const ExtractionReport& now,
                        const ExtractionReport& before) {
  constexpr double kLit = 0.25;              // ratio (chosen): focus and exposure of a rig differ by less
  constexpr double kGradientOfNoise = 1.13;  // its mean absolute difference between two pixels, sigma: 2 / sqrt(pi)
  const double noise[] = {kGradientOfNoise * noiseOf(left), kGradientOfNoise * noiseOf(right)};
  const auto texture = [&](int k) { return std::pow(now.sharpness[k], 2) - std::pow(noise[k], 2); };
  const auto repeats = [&](int k) {
    return now.mean_intensity[k] == before.mean_intensity[k] && now.sharpness[k] == before.sharpness[k];
  };
  for (const int k : {0, 1}) {
    const std::string image = text(0, "the ", k == 0 ? "left" : "right", " image ");
    if (texture(k) < kLit * kLit * texture(1 - k) && texture(1 - k) > noise[1 - k] * noise[1 - k])
      return {image + "has no texture (dark, covered, out of focus, or a shutter?)", {}};
    if (repeats(k) && !repeats(1 - k))
      return refusal(image + "repeats bit by bit, the other one does not: a shutter, or a frozen driver?");
  }
  return {};
}

}  // namespace

RigMonitor::RigMonitor(const RigMonitorOptions& options, double max_dv, double max_disparity)
    : options_(options), max_dv_(max_dv), max_disparity_(max_disparity) {}

bool RigMonitor::isSuspicious(int corners, int found) const {
  return corners >= kEnough && found < options_.suspicious_share * corners;
}

RigDiagnosis RigMonitor::diagnose(const cv::Mat& left, const cv::Mat& right, const std::vector<cv::Point2f>& corners,
                                  const ExtractionReport& report, const ExtractionReport& before) const {
  constexpr std::size_t kMost = 120;  // corners: some milliseconds
  std::vector<cv::Point2f> sought;
  for (std::size_t i = 0; i < corners.size(); i += (corners.size() + kMost - 1) / kMost) sought.push_back(corners[i]);
  const BlockSearch search(left, right, left.cols, kReach);
  const RowLine straight{0.0, 0.0, left.cols};
  std::vector<FoundCorner> found;
  for (const cv::Point2f& corner : sought) {
    const auto there = search.find(corner);
    if (!there) continue;
    found.push_back(*there);
    // Views with little texture are suspicious in every pair. A few corners in order end the search early.
    const int in_order = agreementWith(straight, found, max_dv_).in_order;
    if (in_order >= kAgreeing && in_order > 0.8 * static_cast<double>(found.size()))
      return inOrder(found, left.cols, max_disparity_);
  }
  if (RigDiagnosis of_side = judgeSides(left, right, report, before); !of_side.words.empty()) return of_side;

  const RowLine rows = fitRows(found, left.cols);
  const Agreement on_rows = agreementWith(rows, found, max_dv_);
  std::vector<Cause> causes{
      {agreementWith(straight, found, max_dv_).in_order, inOrder(found, left.cols, max_disparity_)},
      {on_rows.swapped,
       refusal("left and right images are swapped, both are mirrored, or they are of moments between which the camera "
               "turned: corners lie further right in the right image, on their rows")},
      tryFlip(1, "mirrored", left, right, sought, max_dv_),
      tryFlip(-1, "upside down", left, right, sought, max_dv_)};
  const auto blameRows = [&](const std::string& words) {
    causes.push_back({on_rows.in_order, refusal(words + ": not rectified?", rows)});
  };
  if (std::abs(rows.offset) > max_dv_)
    blameRows(text(1, "right image ", std::abs(rows.offset), " px too ", rows.offset > 0.0 ? "low" : "high"));
  else if (0.5 * left.cols * std::abs(rows.slope) > 2.0 * max_dv_)
    blameRows(text(1, "right image turned by ", std::abs(std::atan(rows.slope)) * 180.0 / CV_PI, " degrees ",
                   rows.slope > 0.0 ? "clockwise" : "counterclockwise"));
  const int all = static_cast<int>(found.size());
  if (all >= kEnough && 2 * (on_rows.in_order + on_rows.swapped) < all) {
    std::vector<double> distances;
    for (const FoundCorner& corner : found) distances.push_back(distanceFrom(rows, corner));
    causes.push_back({all, refusal(text(1, "rows of left and right differ by ", median(distances),
                                        " px here and there: not rectified, or not taken at the same moment?"))});
  }
  std::stable_sort(causes.begin(), causes.end(), [](const Cause& a, const Cause& b) { return a.corners > b.corners; });
  const bool is_clear = causes[0].corners >= std::max(kAgreeing, 2 * causes[1].corners);
  return is_clear || !causes[0].diagnosis.refused ? causes[0].diagnosis : RigDiagnosis();
}

}  // namespace sdvo
