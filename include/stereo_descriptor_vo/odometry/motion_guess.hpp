#pragma once

#include <Eigen/Geometry>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Motion of the camera since the previous pair, from another source than images.
struct MotionGuess {
  Eigen::Isometry3d T_previous_current = Eigen::Isometry3d::Identity();
  bool rotation_only = false;  ///< from a gyro: the translation is not used
  /// Standard deviation as a ratio of distance and angle. It is one error of scale in all guesses, so their errors add
  /// up.
  double error = 0.1;

  /// Throws std::invalid_argument if it is not a rigid motion, or its error is not positive.
  void check() const;
};

}  // namespace sdvo
