#include "row_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "../common/median.hpp"
#include "../common/text.hpp"
#include "../front_end/block_search.hpp"

namespace sdvo {
namespace {

constexpr std::size_t kCells = static_cast<std::size_t>(RowCheck::kColumns) * RowCheck::kRows;

/// Where points went, to a fraction of a pixel; `guess` in, result out. Whether each was found.
std::vector<std::uint8_t> track(const cv::Mat& from, const cv::Mat& to, const std::vector<cv::Point2f>& points,
                                std::vector<cv::Point2f>& guess, int levels) {
  std::vector<std::uint8_t> found;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(from, to, points, guess, found, error, cv::Size(13, 13), levels,
                           cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.01),
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  return found;
}

double distance(const cv::Point2f& a, const cv::Point2f& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

}  // namespace

void RowCheck::add(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp) {
  constexpr std::int64_t kPeriod = 190000000;  // ns; five pairs a second tell enough
  const cv::Mat before = before_;
  const double dt = 1e-9 * static_cast<double>(stamp - stamp_before_);
  before_ = left.clone();
  stamp_before_ = stamp;
  if (before.size() != left.size() || !(dt > 0.0) || stamp - last_ < kPeriod) return;
  last_ = stamp;
  size_ = left.size();

  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(left, corners, 200, 0.01, 8.0);
  corners_ += static_cast<int>(corners.size());
  const BlockSearch search(left, right, max_disparity_, reach_);
  std::vector<cv::Point2f> points, in_right;
  for (const cv::Point2f& corner : corners)
    if (const auto sighting = search.find(corner)) {
      points.push_back(corner);
      in_right.emplace_back(corner.x - static_cast<float>(sighting->disparity),
                            corner.y + static_cast<float>(sighting->dv));
    }
  if (points.empty()) return;

  const std::vector<cv::Point2f> blocks = in_right;
  std::vector<cv::Point2f> in_before = points, back;
  const auto refined = track(left, right, points, in_right, 0), followed = track(left, before, points, in_before, 4);
  back = in_before;
  const auto returned = track(before, left, in_before, back, 0);
  ++pairs_;
  for (std::size_t i = 0; i < points.size(); ++i) {
    constexpr double kBlock = 1.5, kReturn = 0.5;  // px: a block is found to a pixel, a track returns (chosen)
    if (!refined[i] || distance(in_right[i], blocks[i]) > kBlock) continue;
    if (!followed[i] || !returned[i] || distance(back[i], points[i]) > kReturn) continue;
    const int column = std::min(static_cast<int>(points[i].x) * kColumns / size_.width, kColumns - 1);
    const int row = std::min(static_cast<int>(points[i].y) * kRows / size_.height, kRows - 1);
    samples_.push_back({pairs_, row * kColumns + column, static_cast<double>(in_right[i].y - points[i].y),
                        static_cast<double>(points[i].y - in_before[i].y) / dt});
  }
}

/// Least squares on what differs from each cell's mean, so that no error of the rectification counts; with the weights
/// of a Huber kernel. Errors of one pair may be alike, so its standard deviation is that of whole pairs.
std::optional<RowCheck::Delay> RowCheck::delay() const {
  constexpr std::size_t kEnough = 300;  // samples (chosen): a dozen a part
  constexpr double kKernel = 0.5;       // px (chosen): errors of healthy rows are smaller
  constexpr double kMoving = 10.0;      // px/s (RMS); 10 ms are a tenth of a pixel then
  constexpr double kUseful = 0.005;     // s; a delay that is not known better than that is not judged
  if (samples_.size() < kEnough) return std::nullopt;
  std::vector<double> weights(samples_.size(), 1.0);
  Delay delay{0.0, 0.0};
  for (int iteration = 0; iteration < 10; ++iteration) {
    std::vector<double> weight(kCells, 0.0), dv(kCells, 0.0), velocity(kCells, 0.0);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const auto cell = static_cast<std::size_t>(samples_[i].cell);
      weight[cell] += weights[i];
      dv[cell] += weights[i] * samples_[i].dv;
      velocity[cell] += weights[i] * samples_[i].velocity;
    }
    const auto centred = [&](const Sample& sample) {
      const auto cell = static_cast<std::size_t>(sample.cell);
      return cv::Point2d(sample.velocity - velocity[cell] / weight[cell], sample.dv - dv[cell] / weight[cell]);
    };
    double total = 0.0, square = 0.0, product = 0.0;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const cv::Point2d sample = centred(samples_[i]);
      total += weights[i];
      square += weights[i] * sample.x * sample.x;
      product += weights[i] * sample.x * sample.y;
    }
    if (!(square > kMoving * kMoving * total)) return std::nullopt;
    delay.value = product / square;
    std::vector<double> by_pair(static_cast<std::size_t>(pairs_) + 1, 0.0);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const cv::Point2d sample = centred(samples_[i]);
      const double rest = sample.y - delay.value * sample.x;
      by_pair[static_cast<std::size_t>(samples_[i].pair)] += weights[i] * sample.x * rest;
      weights[i] = std::min(1.0, kKernel / std::max(std::abs(rest), 1e-9));
    }
    double spread = 0.0;
    for (const double sum : by_pair) spread += sum * sum;
    delay.sigma = std::sqrt(spread) / square;
  }
  if (!(delay.sigma < kUseful)) return std::nullopt;
  return delay;
}

/// A delay that is proved, s; else zero.
double RowCheck::compensation() const {
  constexpr double kSignificant = 4.0;  // standard deviations
  const auto found = delay();
  return found && std::abs(found->value) > kSignificant * found->sigma ? found->value : 0.0;
}

cv::Mat RowCheck::map() const {
  constexpr std::size_t kEnough = 10;
  const double late = compensation();
  std::vector<std::vector<double>> cells(kCells);
  for (const Sample& sample : samples_)
    cells[static_cast<std::size_t>(sample.cell)].push_back(sample.dv - late * sample.velocity);
  cv::Mat map(kRows, kColumns, CV_64F, cv::Scalar(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t cell = 0; cell < kCells; ++cell)
    if (cells[cell].size() >= kEnough) map.at<double>(static_cast<int>(cell)) = median(cells[cell]);
  return map;
}

Finding RowCheck::rectification() const {
  const std::string step = "rectification";
  const cv::Mat rows = map();
  double worst = 0.0, square = 0.0;
  int known = 0, bad = 0;
  for (const double dv : cv::Mat_<double>(rows)) {
    if (std::isnan(dv)) continue;
    ++known;
    bad += std::abs(dv) > max_dv_;
    square += dv * dv;
    worst = std::abs(dv) > std::abs(worst) ? dv : worst;
  }
  if (4 * known < static_cast<int>(kCells)) {
    if (corners_ > 1000 && static_cast<int>(samples_.size()) < corners_ / 20)
      return {step, Verdict::kFail,
              text(0, "of ", corners_, " corners ", samples_.size(), " are found in the right image"),
              "left and right do not show the same scene: look at both"};
    return {step, Verdict::kOpen, "too few corners are found in both images", "show it a scene with texture"};
  }
  const double rms = std::sqrt(square / known);
  const std::string what = text(2, "rows differ by ", rms, " px (RMS over the image), ", worst, " at worst, in ", known,
                                " of ", kCells, " parts");
  const std::string remedy = "raw images under the name of rectified ones? Else calibrate the pair again";
  if (10 * bad > known) return {step, Verdict::kFail, what, remedy};
  if (rms > 0.35 * max_dv_) return {step, Verdict::kWarn, what, remedy};
  return {step, Verdict::kOk, what, ""};
}

Finding RowCheck::sameMoment() const {
  constexpr double kWarn = 0.002, kFail = 0.01;  // s; 2 ms is 2 cm at 10 m/s, and 0.4 px at 100 deg/s and f = 120 px
  const std::string step = "same moment";
  const auto found = delay();
  if (!found) return {step, Verdict::kOpen, "rows hardly moved", "tilt the camera up and down"};
  const std::string what = text(1, "right image ", 1e3 * found->value, " ms later than left, +- ", 1e3 * found->sigma);
  const double late = std::abs(compensation());
  const std::string remedy = "trigger both cameras together, and stamp each image with its own time";
  if (late > kFail) return {step, Verdict::kFail, what, remedy};
  if (late > kWarn) return {step, Verdict::kWarn, what, remedy};
  return {step, Verdict::kOk, what, ""};
}

}  // namespace sdvo
