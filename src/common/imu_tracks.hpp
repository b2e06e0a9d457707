#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "stamp_filter.hpp"

namespace sdvo {

/// Which way is up, as an accelerometer that stands measures it. May be used by several threads.
class GravityTrack {
 public:
  /// `acceleration`: m/s^2, and `rate`: rad/s, in the sensor's axes; `stamp`: ns. What is not finite is left out; a
  /// stamp that is not later than the last one begins anew.
  void add(std::int64_t stamp, const Eigen::Vector3d& acceleration, const Eigen::Vector3d& rate);

  /// Unit vector in the sensor's axes, the mean of the last second; nothing, and why, unless that second is there, the
  /// sensor stood and measured gravity alone.
  std::optional<Eigen::Vector3d> up(std::string* problem = nullptr) const;

 private:
  struct Measurement {
    std::int64_t stamp;
    Eigen::Vector3d acceleration, rate;
  };

  mutable std::mutex mutex_;
  std::deque<Measurement> measurements_;  ///< of the last second
};

/// `pose` with its position and yaw, and with roll and pitch such that `up`, in the axes of its child frame, is its
/// parent's z.
Eigen::Isometry3d levelled(const Eigen::Isometry3d& pose, const Eigen::Vector3d& up);

/// The rates that a gyro has measured in the last seconds, and how it turned between two of those times. May be used by
/// several threads.
class GyroTrack {
 public:
  /// `rate`: rad/s in the gyro's axes; `stamp` and `now`, the clock's time: ns. What is not finite is left out, and
  /// what is late or has a wild stamp; stamps that stay behind begin anew.
  void add(std::int64_t stamp, std::int64_t now, const Eigen::Vector3d& rate);

  /// R_from_to, as in v_from = R_from_to * v_to; nothing, and why, unless measurements reach from one time to the other
  /// without a pause of a tenth of a second.
  std::optional<Eigen::Matrix3d> rotation(std::int64_t from, std::int64_t to, std::string* problem = nullptr) const;

 private:
  struct Measurement {
    std::int64_t stamp;
    Eigen::Vector3d rate;
  };

  mutable std::mutex mutex_;
  StampFilter<Measurement> filter_;
  int restarts_ = 0;
  std::deque<Measurement> measurements_;
};

}  // namespace sdvo
