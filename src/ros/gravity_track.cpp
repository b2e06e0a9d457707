#include "gravity_track.hpp"

#include <cmath>
#include <cstddef>

namespace sdvo {
namespace {

constexpr std::int64_t kPeriod = 1'000'000'000;  // ns
constexpr double kGravity = 9.8, kBias = 0.5;    // m/s^2
constexpr double kStandsRate = 0.1;              // rad/s
constexpr double kStandsAcceleration = 0.5;      // m/s^2, root mean square about the mean
constexpr std::size_t kFewest = 10;              // measurements

}  // namespace

void GravityTrack::add(std::int64_t stamp, const Eigen::Vector3d& acceleration, const Eigen::Vector3d& rate) {
  if (!acceleration.allFinite() || !rate.allFinite()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!measurements_.empty() && stamp <= measurements_.back().stamp) measurements_.clear();
  measurements_.push_back({stamp, acceleration, rate});
  // One that is older stays, so that a whole second is seen to be there.
  while (measurements_.size() > 1 && stamp - measurements_[1].stamp >= kPeriod) measurements_.pop_front();
}

std::optional<Eigen::Vector3d> GravityTrack::up() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (measurements_.size() < kFewest || measurements_.back().stamp - measurements_.front().stamp < kPeriod)
    return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Measurement& m : measurements_) mean += m.acceleration / static_cast<double>(measurements_.size());
  double square = 0.0;
  for (const Measurement& m : measurements_) {
    if (m.rate.norm() > kStandsRate) return std::nullopt;
    square += (m.acceleration - mean).squaredNorm() / static_cast<double>(measurements_.size());
  }
  if (std::sqrt(square) > kStandsAcceleration || std::abs(mean.norm() - kGravity) > kBias) return std::nullopt;
  return mean.normalized();
}

Eigen::Isometry3d levelled(const Eigen::Isometry3d& pose, const Eigen::Vector3d& up) {
  const Eigen::Matrix3d& R = pose.linear();
  return Eigen::Translation3d(pose.translation()) *
         Eigen::AngleAxisd(std::atan2(R(1, 0), R(0, 0)), Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(std::atan2(-up.x(), std::hypot(up.y(), up.z())), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(std::atan2(up.y(), up.z()), Eigen::Vector3d::UnitX());
}

}  // namespace sdvo
