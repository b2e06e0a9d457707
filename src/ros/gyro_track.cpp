#include "gyro_track.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {
namespace {

constexpr std::int64_t kKept = 10'000'000'000;  // ns
constexpr std::int64_t kLongest = 100'000'000;  // ns between two measurements

double seconds(std::int64_t nanoseconds) {
  return 1e-9 * static_cast<double>(nanoseconds);
}

}  // namespace

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

std::optional<Eigen::Matrix3d> GyroTrack::rotation(std::int64_t from, std::int64_t to) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (from > to || measurements_.empty() || measurements_.front().stamp > from || measurements_.back().stamp < to)
    return std::nullopt;
  Eigen::Matrix3d R_from_to = Eigen::Matrix3d::Identity();
  for (std::size_t k = 1; k < measurements_.size(); ++k) {
    const Measurement &a = measurements_[k - 1], &b = measurements_[k];
    const std::int64_t begin = std::max(a.stamp, from), end = std::min(b.stamp, to);
    if (begin >= end) continue;
    if (b.stamp - a.stamp >= kLongest) return std::nullopt;
    // The rate in the middle, which is linear between the two.
    const double share = 0.5 * seconds(begin - a.stamp + end - a.stamp) / seconds(b.stamp - a.stamp);
    R_from_to = R_from_to * expSO3((a.rate + share * (b.rate - a.rate)) * seconds(end - begin));
  }
  return R_from_to;
}

}  // namespace sdvo
