#include "imu_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "text.hpp"

namespace sdvo {
namespace {

constexpr std::int64_t kPeriod = 1'000'000'000;  // ns
constexpr double kGravity = 9.8, kBias = 0.5;    // m/s^2
constexpr double kStandsRate = 0.1;              // rad/s
constexpr double kStandsAcceleration = 0.5;      // m/s^2, root mean square about the mean
constexpr std::size_t kFewest = 10;              // measurements
constexpr std::int64_t kKept = 10'000'000'000;   // ns
constexpr std::int64_t kLongest = 100'000'000;   // ns between two measurements

double seconds(std::int64_t nanoseconds) {
  return 1e-9 * static_cast<double>(nanoseconds);
}

}  // namespace

void GravityTrack::add(std::int64_t stamp, const Eigen::Vector3d& acceleration, const Eigen::Vector3d& rate) {
  if (!acceleration.allFinite() || !rate.allFinite()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!measurements_.empty() && stamp <= measurements_.back().stamp) measurements_.clear();
  measurements_.push_back({stamp, acceleration, rate});
  // One measurement from before the last second stays: up() compares the first and last stamp with a second.
  while (measurements_.size() > 1 && stamp - measurements_[1].stamp >= kPeriod) measurements_.pop_front();
}

std::optional<Eigen::Vector3d> GravityTrack::up(std::string* problem) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto refuse = [problem](const auto&... what) {
    if (problem) *problem = text(1, what...);
    return std::nullopt;
  };
  if (measurements_.empty()) return refuse("no acceleration has come");
  if (measurements_.size() < kFewest || measurements_.back().stamp - measurements_.front().stamp < kPeriod)
    return refuse("less than a second of accelerations has come");
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Measurement& m : measurements_) mean += m.acceleration / static_cast<double>(measurements_.size());
  double square = 0.0, rate = 0.0;
  for (const Measurement& m : measurements_) {
    rate = std::max(rate, m.rate.norm());
    square += (m.acceleration - mean).squaredNorm() / static_cast<double>(measurements_.size());
  }
  if (std::abs(mean.norm() - 1.0) < kBias / kGravity)
    return refuse("|acceleration| = ", mean.norm(), ": is it in g? sensor_msgs/Imu wants m/s^2");
  if (rate > kStandsRate) return refuse("the robot turns, by ", rate, " rad/s: start while it stands");
  if (std::sqrt(square) > kStandsAcceleration) return refuse("the robot shakes or accelerates: start while it stands");
  if (std::abs(mean.norm() - kGravity) > kBias)
    return refuse("|acceleration| = ", mean.norm(), " m/s^2 is not that of gravity, ", kGravity);
  return mean.normalized();
}

Eigen::Isometry3d levelled(const Eigen::Isometry3d& pose, const Eigen::Vector3d& up) {
  const Eigen::Matrix3d& R = pose.linear();
  return Eigen::Translation3d(pose.translation()) *
         Eigen::AngleAxisd(std::atan2(R(1, 0), R(0, 0)), Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(std::atan2(-up.x(), std::hypot(up.y(), up.z())), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(std::atan2(up.y(), up.z()), Eigen::Vector3d::UnitX());
}

void GyroTrack::add(std::int64_t stamp, std::int64_t now, const Eigen::Vector3d& rate) {
  if (!rate.allFinite()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& passed : filter_.add({stamp, rate}, stamp, now)) {
    const int restarts = passed.source_restarts + passed.clock_steps;
    if (std::exchange(restarts_, restarts) != restarts) measurements_.clear();
    measurements_.push_back(passed.item);
  }
  while (!measurements_.empty() && measurements_.back().stamp - measurements_.front().stamp > kKept)
    measurements_.pop_front();
}

std::optional<Eigen::Matrix3d> GyroTrack::rotation(std::int64_t from, std::int64_t to, std::string* problem) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto refuse = [problem](const auto&... what) {
    if (problem) *problem = text(3, what...);
    return std::nullopt;
  };
  if (measurements_.empty()) return refuse("no rate has come");
  if (from > to) return refuse("the images' stamps fall");
  if (measurements_.back().stamp < to)
    return refuse("its newest rate is ", seconds(to - measurements_.back().stamp),
                  " s older than the image: does it come late, or by another clock?");
  if (measurements_.front().stamp > from)
    return refuse("its oldest rate is ", seconds(measurements_.front().stamp - from),
                  " s newer than the image before: did it just start, or is its clock another one?");
  Eigen::Matrix3d R_from_to = Eigen::Matrix3d::Identity();
  for (std::size_t k = 1; k < measurements_.size(); ++k) {
    const Measurement &a = measurements_[k - 1], &b = measurements_[k];
    const std::int64_t begin = std::max(a.stamp, from), end = std::min(b.stamp, to);
    if (begin >= end) continue;
    if (b.stamp - a.stamp >= kLongest)
      return refuse("a pause of ", seconds(b.stamp - a.stamp), " s between two of its rates");
    // The mean rate from `begin` to `end`: that in the middle, linearly interpolated between a and b.
    const double share = 0.5 * seconds(begin - a.stamp + end - a.stamp) / seconds(b.stamp - a.stamp);
    R_from_to = R_from_to * expSO3((a.rate + share * (b.rate - a.rate)) * seconds(end - begin));
  }
  return R_from_to;
}

}  // namespace sdvo
