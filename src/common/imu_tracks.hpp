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
  /// `acceleration`: m/s^2, and `rate`: rad/s, in the sensor's axes; `stamp`: ns. Measurements that are not finite are
  /// ignored. A stamp that does not rise clears the track.
  void add(std::int64_t stamp, const Eigen::Vector3d& acceleration, const Eigen::Vector3d& rate);

  /// Unit vector in the sensor's axes, the mean of the last second. Nothing, and `problem` says why, if there is less
  /// than a second, the sensor moved, or the mean has not the length of gravity.
  std::optional<Eigen::Vector3d> up(std::string* problem = nullptr) const;

 private:
  struct Measurement {
    std::int64_t stamp;
    Eigen::Vector3d acceleration, rate;
  };

  mutable std::mutex mutex_;
  std::deque<Measurement> measurements_;  ///< of the last second
};

/// `pose` with new roll and pitch: its rotation turns `up`, given in the child's axes, into the parent's z. Position
/// and yaw stay.
Eigen::Isometry3d levelled(const Eigen::Isometry3d& pose, const Eigen::Vector3d& up);

/// The rates that a gyro has measured in the last seconds, and how it turned between two of those times. May be used by
/// several threads.
class GyroTrack {
 public:
  /// `rate`: rad/s in the gyro's axes; `stamp` and `now`, the clock's time: ns. Rates that are not finite are ignored,
  /// and those that StampFilter drops. If the stamps jump back for good, the track is cleared.
  void add(std::int64_t stamp, std::int64_t now, const Eigen::Vector3d& rate);

  /// R_from_to, as in v_from = R_from_to * v_to. Nothing, and `problem` says why, unless measurements cover the
  /// interval without a pause of a tenth of a second.
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
