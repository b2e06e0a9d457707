#pragma once

#include <optional>

#include "../rig/row_delay.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"

namespace sdvo {

/// Readout time of a rolling shutter, from the first row to the last. While the camera turns, each row has another
/// pose: a point v px below the middle is shifted by its image velocity * readout * v / height. A motion explains part
/// of the shift, and at constant velocity other positions of the points explain all of it. So only changes of the
/// velocity are used, and the estimate is a lower bound.
class RowReadout {
 public:
  /// s. Estimates for global shutters are up to 2 ms (MH_01); a readout of 3 ms causes position errors of 5 sigma.
  static constexpr double kWarn = 0.003;

  struct Estimate {
    double value, sigma;  ///< s

    bool isRolling() const { return value > kWarn && value * value > RowDelay::kSquare * sigma * sigma; }
  };

  /// Adds a pair with a measured motion. Uses the vertical and horizontal residuals of its matches.
  void add(const StereoFeatures& features, const OdometryResult& result);

  std::optional<Estimate> estimate() const;

 private:
  double information_ = 0.0, product_ = 0.0;  ///< px^2/s^2, px^2/s
  /// Sums over pairs of squares and products of information and product, for the empirical deviation.
  double information_square_ = 0.0, mixed_ = 0.0, product_square_ = 0.0;
  double pairs_ = 0.0;
  Vector6d usual_velocity_ = Vector6d::Zero();
};

}  // namespace sdvo
