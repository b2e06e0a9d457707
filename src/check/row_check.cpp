#include "row_check.hpp"

#include <cmath>
#include <limits>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "../front_end/block_search.hpp"

namespace sdvo {

void RowCheck::add(const CornerPair& pair) {
  corners_ += static_cast<int>(pair.corners.size());
  const BlockSearch search(pair.left, pair.right, max_disparity_, reach_);
  std::vector<cv::Point2f> points, in_right;
  for (const cv::Point2f& corner : pair.corners)
    if (const auto sighting = search.find(corner)) {
      points.push_back(corner);
      in_right.emplace_back(corner.x - static_cast<float>(sighting->disparity),
                            corner.y + static_cast<float>(sighting->dv));
    }
  const std::vector<cv::Point2f> blocks = in_right;
  std::vector<cv::Point2f> in_before;
  const auto refined = track(pair.left, pair.right, points, in_right, 0);
  const auto followed = trackBothWays(pair.left, pair.before, points, in_before, 0);
  std::vector<RowDelay::Sample> rows;
  for (std::size_t i = 0; i < points.size(); ++i) {
    constexpr double kBlock = 1.5;  // px: a block is found to a pixel (chosen)
    if (!refined[i] || !followed[i] || distance(in_right[i], blocks[i]) > kBlock) continue;
    const int part = RowDelay::partOf(points[i].x, points[i].y, pair.left.cols, pair.left.rows);
    const double velocity = static_cast<double>(points[i].y - in_before[i].y) / pair.dt;
    rows.push_back({part, static_cast<double>(in_right[i].y - points[i].y), velocity, velocity,
                    static_cast<double>(points[i].x - in_right[i].x)});
  }
  samples_.insert(samples_.end(), rows.begin(), rows.end());
  delay_.add(rows);
}

cv::Mat RowCheck::map() const {
  constexpr std::size_t kEnough = 10;
  const auto found = delay_.estimate();
  const double late = found ? found->significantValue() : 0.0;
  std::vector<std::vector<double>> parts(RowDelay::kParts);
  for (const RowDelay::Sample& sample : samples_)
    parts[static_cast<std::size_t>(sample.part)].push_back(sample.dv - late * sample.velocity);
  cv::Mat map(RowDelay::kRows, RowDelay::kColumns, CV_64F, cv::Scalar(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t part = 0; part < RowDelay::kParts; ++part)
    if (parts[part].size() >= kEnough) map.at<double>(static_cast<int>(part)) = median(parts[part]);
  return map;
}

Finding RowCheck::rectification() const {
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
  if (4 * known < static_cast<int>(RowDelay::kParts)) {
    if (corners_ > 1000 && static_cast<int>(samples_.size()) < corners_ / 20)
      return {Verdict::kFail, text(0, "of ", corners_, " corners ", samples_.size(), " are found in the right image"),
              "left and right do not show the same scene: look at both"};
    return {Verdict::kOpen, "too few corners are found in both images", "show it a scene with texture"};
  }
  const double rms = std::sqrt(square / known);
  const std::string what = text(2, "rows differ by ", rms, " px (RMS over the image), ", worst, " at worst, in ", known,
                                " of ", RowDelay::kParts, " parts");
  constexpr double kMuch = 0.45;  // of what features may have (chosen): KITTI 01, a reference, has 0.37
  return judged(10 * bad > known, rms > kMuch * max_dv_, what,
                "raw images under the name of rectified ones? Else calibrate the pair again");
}

Finding RowCheck::sameMoment() const {
  const auto found = delay_.estimate();
  return found ? checkMoment(*found) : Finding{Verdict::kOpen, "rows hardly moved", "tilt the camera up and down"};
}

Finding checkMoment(const RowDelay::Estimate& right) {
  const double late = std::abs(right.significantValue());
  return judged(late > RowDelay::kFail, late > RowDelay::kWarn,
                text(1, "right images are taken ", 1e3 * std::abs(right.value), " +- ", 1e3 * right.sigma, " ms ",
                     right.value > 0.0 ? "after" : "before", " left ones"),
                "trigger both cameras together, and stamp each image with its own time; calibration/right_delay takes "
                "a known delay");
}

}  // namespace sdvo
