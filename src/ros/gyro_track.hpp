#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>

#include "stamp_filter.hpp"

namespace sdvo {

/// The rates that a gyro has measured in the last seconds, and how it turned between two of those times. May be used by
/// several threads.
class GyroTrack {
 public:
  /// `rate`: rad/s in the gyro's axes; `stamp` and `now`, the clock's time: ns. What is not finite is left out, and
  /// what is late or has a wild stamp; stamps that stay behind begin anew.
  void add(std::int64_t stamp, std::int64_t now, const Eigen::Vector3d& rate);

  /// R_from_to, as in v_from = R_from_to * v_to; nothing unless measurements reach from one time to the other without
  /// a pause of a tenth of a second.
  std::optional<Eigen::Matrix3d> rotation(std::int64_t from, std::int64_t to) const;

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
