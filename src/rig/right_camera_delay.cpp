#include "right_camera_delay.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <limits>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "../motion/noise.hpp"
#include "rolling_shutter.hpp"

namespace sdvo {
namespace {

/// Velocity (px/s) of a point in the right image: at infinity, and its part for each px of disparity.
struct RightFlow {
  Eigen::Vector2d far, near;
};

/// `u`, `v`: position in the right image, px.
RightFlow rightFlow(const StereoCamera& camera, const Vector6d& velocity, double u, double v) {
  const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
  const Eigen::Vector3d turn = velocity.tail<3>();
  const Eigen::Vector3d translation = velocity.head<3>() + turn.cross(camera.baseline * Eigen::Vector3d::UnitX());
  const double disparity = camera.fx * camera.baseline;  // at 1 m
  return {{camera.fx * (turn.x() * x * y - turn.y() * (1.0 + x * x) + turn.z() * y),
           camera.fy * (turn.x() * (1.0 + y * y) - turn.y() * x * y - turn.z() * x)},
          Eigen::Vector2d(camera.fx * (x * translation.z() - translation.x()),
                          camera.fy * (y * translation.z() - translation.y())) /
              disparity};
}

/// Disparity (px) of a feature without the delay, and its velocity in the right image (px/s) during the delay.
struct Synchronised {
  double disparity;
  Eigen::Vector2d flow;
};

Synchronised synchronised(const StereoFeatures& features, int i, double delay, const Vector6d& velocity) {
  const double u = features.u[i] - features.disparity[i], v = features.v[i] + features.dv[i];
  Synchronised result{features.disparity[i], Eigen::Vector2d::Zero()};
  const int iterations = delay == 0.0 ? 1 : 2;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    // In the middle of the delay.
    const RightFlow flow =
        rightFlow(features.camera, velocity, u - 0.5 * delay * result.flow.x(), v - 0.5 * delay * result.flow.y());
    // disparity = measured + delay * (far + disparity * near), solved for it.
    result.disparity = (features.disparity[i] + delay * flow.far.x()) / (1.0 - delay * flow.near.x());
    result.flow = flow.far + result.disparity * flow.near;
  }
  return result;
}

/// Mean velocity during the delay, from that at the pair and the means over the intervals before and after it.
Vector6d velocityDuring(double delay, double dt, const Vector6d& before, const Vector6d& at, const Vector6d& after) {
  const double ratio = std::min(std::abs(delay) / dt, 1.0);
  return at + ratio * ((delay < 0.0 ? before : after) - at);
}

/// Mean squared residual (px^2, each cut off) of rows against a right image that is late by `delay` and lower by a
/// constant.
double misfit(const std::vector<RowMotion>& rows, double delay) {
  constexpr double kCut = 2.0 * RowDelay::kKernel;  // px: larger residuals are wrong matches
  std::vector<double> residuals;
  residuals.reserve(rows.size());
  for (const RowMotion& row : rows) residuals.push_back(row.dv - delay * row.velocity);
  std::vector<double> sorted = residuals;
  const double middle = median(sorted);
  double sum = 0.0;
  for (const double each : residuals) sum += std::min((each - middle) * (each - middle), kCut * kCut);
  return sum / static_cast<double>(residuals.size());
}

/// Ratio of the rows' apparent motion during `delay` that is error of the left image. Velocity and dv share this error,
/// so even in a synchronous rig dv follows the velocity by this ratio (errors in variables, Fuller 1987). `row_error`:
/// its standard deviation, px.
double errorRatio(const std::vector<RowMotion>& rows, double delay, double row_error) {
  double sum = 0.0, square = 0.0;
  for (const RowMotion& row : rows) sum += row.velocity, square += row.velocity * row.velocity;
  const double count = static_cast<double>(rows.size());
  const double variance = delay * delay * (square / count - sum * sum / (count * count));
  return variance > row_error * row_error ? row_error * row_error / variance : 1.0;
}

constexpr int kSamePoints = 2;         // successive pairs with correlated errors (chosen)
constexpr double kLeastTurning = 2.0;  // px/s: more than errors of measured rotations

}  // namespace

double logRatioOfDelay(const std::vector<RowMotion>& rows, double delay, double row_error) {
  // The velocity ends at this left image, so an error of its rows is in the velocity and, negated, in dv: as if the
  // right image were of an earlier moment.
  std::bitset<RowDelay::kParts> seen;
  for (const RowMotion& row : rows) seen.set(static_cast<std::size_t>(row.part));
  const double parts = static_cast<double>(seen.count()) - 1.0;  // one fixes the constant
  const double synchronised = misfit(rows, delay < 0.0 ? delay * errorRatio(rows, delay, row_error) : 0.0);
  const double late = misfit(rows, delay);
  return synchronised == late ? 0.0 : 0.5 * parts * std::log(synchronised / late);
}

RightCameraDelay::RightCameraDelay() : rows_(RowDelay::kMemory, kLeastTurning, kSamePoints) {}

void RightCameraDelay::updateOtherPair(const std::vector<RowMotion>& rows, double dt, double row_error) {
  if (rows.size() < kFewestMeasured || !(dt > 0.0)) return;
  for (auto* other : {&log_odds_earlier_, &log_odds_later_}) {
    // Evidence fades without renewal, because a standing camera gives none.
    const double carried = kUnsuspected + kUsualMemory * (*other - kUnsuspected);
    *other = std::clamp(carried + logRatioOfDelay(rows, other == &log_odds_earlier_ ? -dt : dt, row_error),
                        kUnsuspected, kCertain);
  }
}

void RightCameraDelay::learn(const StereoFeatures& features, double dt, const Vector6d& velocity, double known,
                             bool is_confirmed) {
  if (!is_confirmed) return interrupt();
  pairs_.push_back({features, velocity});
  if (pairs_.size() < 4) return;
  // Rows of the third last pair, between intervals of known velocity. The instrument is the mean over the four
  // intervals around it: it lacks motions too fast for the rate of pairs.
  const StereoFeatures& middle = pairs_[1].features;
  const StereoCamera& camera = middle.camera;
  const double stamped = middle.right_delay, delay = stamped + known;
  const Vector6d inner = pairs_[1].velocity + pairs_[2].velocity, outer = pairs_[0].velocity + pairs_[3].velocity;
  const Vector6d at = velocityAmong(pairs_[0].velocity, pairs_[1].velocity, pairs_[2].velocity, pairs_[3].velocity);
  const Vector6d during = velocityDuring(delay, dt, pairs_[1].velocity, at, pairs_[2].velocity);
  const Vector6d slow = 0.25 * (inner + outer);
  std::vector<RowDelay::Sample> rows;
  rows.reserve(middle.u.size());
  for (int i = 0; i < middle.count(); ++i) {
    const Synchronised step = sdvo::synchronised(middle, i, delay, during);
    const RightFlow turning = rightFlow(camera, slow, middle.u[i] - middle.disparity[i], middle.v[i]);
    rows.push_back({RowDelay::partOf(middle.u[i], middle.v[i], camera.width, camera.height),
                    middle.dv[i] - stamped * step.flow.y(), step.flow.y(), turning.far.y(), step.disparity});
  }
  rows_.add(rows);
  pairs_.pop_front();
}

RightCameraDelay::OtherPair RightCameraDelay::otherPair(double dt) const {
  return log_odds_earlier_ > log_odds_later_ ? OtherPair{-dt, log_odds_earlier_} : OtherPair{dt, log_odds_later_};
}

std::string RightCameraDelay::OtherPair::words() const {
  return text(0, "the right image seemed to be that of another pair, taken ", 1e3 * std::abs(delay), " ms ",
              delay < 0.0 ? "earlier" : "later");
}

StereoFeatures RightCameraDelay::synchronised(const StereoFeatures& features, double dt, const Vector6d& velocity,
                                              double known) const {
  const double delay = features.right_delay + known;
  // The velocity changes as it did over the last interval.
  const Vector6d change = pairs_.empty() ? Vector6d::Zero() : Vector6d(velocity - pairs_.back().velocity);
  const Vector6d during = velocityDuring(delay, dt, velocity, velocity + 0.5 * change, velocity + change);
  constexpr double kFar = std::numeric_limits<float>::epsilon();  // px: for points that noise puts beyond infinity
  StereoFeatures result = features;
  result.right_delay = 0.0;
  for (int i = 0; i < features.count(); ++i) {
    const Synchronised step = sdvo::synchronised(features, i, delay, during);
    // In sideways motion a late camera may be where the left one was: disparities vanish.
    result.disparity[i] = static_cast<float>(std::clamp<double>(step.disparity, kFar, features.camera.width));
    result.dv[i] -= static_cast<float>(delay * step.flow.y());
  }
  return result;
}

}  // namespace sdvo
