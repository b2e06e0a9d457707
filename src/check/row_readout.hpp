#pragma once

#include <optional>

#include "../rig/row_delay.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"

namespace sdvo {

/// The time that a rolling shutter takes from the first row to the last. While the camera turns, each row sees another
/// pose: a point v px below the middle is off by its velocity in the image * readout * v / height. A part of that looks
/// like a motion, and a steady one like points that lie elsewhere: what changes is left, and the estimate is a lower
/// bound.
class RowReadout {
 public:
  /// s. Global shutters give up to 2 ms (MH_01, proved by its deviation), and one of 3 ms makes 5 sigma of position.
  static constexpr double kWarn = 0.003;

  struct Estimate {
    double value, sigma;  ///< s

    bool isRolling() const { return value > kWarn && value * value > RowDelay::kSquare * sigma * sigma; }
  };

  /// Takes in a pair with its motion, if that was measured. Its rows are compared with where the motion has the
  /// matches.
  void add(const StereoFeatures& features, const OdometryResult& result);

  std::optional<Estimate> estimate() const;

 private:
  double information_ = 0.0, product_ = 0.0;  ///< px^2/s^2, px^2/s
  /// Sums over pairs, whose errors may be alike, of squares of information and product.
  double information_square_ = 0.0, mixed_ = 0.0, product_square_ = 0.0;
  double pairs_ = 0.0;
  Vector6d usual_velocity_ = Vector6d::Zero();
};

}  // namespace sdvo
