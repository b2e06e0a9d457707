#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// How well the adjustment of a window knows motions between its frames: covariances of right perturbations, m and rad.
struct WindowCovariances {
  int first_id = 0;                                  ///< of the window's first frame
  Matrix6d since_keyframe = Matrix6d::Zero();        ///< the newest frame since the key frame before it
  Matrix6d since_first = Matrix6d::Zero();           ///< the newest frame since the first
  Matrix6d since_second = Matrix6d::Zero();          ///< the newest frame since the second, which may be the first soon
  Matrix6d keyframe_since_first = Matrix6d::Zero();  ///< that key frame since the first frame

  /// The newest frame is known worse than that by a factor.
  void inflateNewest(double factor) {
    for (Matrix6d* covariance : {&since_keyframe, &since_first, &since_second}) *covariance *= factor;
  }
};

/// Widens a covariance by a deviation whose square is more than half of what it expects on average (chi-square of six).
/// Whether it was so beyond chance (95 %).
bool widen(Matrix6d& covariance, const Vector6d& deviation);

/// Covariance of a pose that is reported again and again while later pairs improve what is known of it. What is
/// reported stays true: a motion's covariance is that between two *reported* poses, so it contains what the earlier one
/// lacked; and the pose's covariance grows from key frame to key frame, because all pairs since the last one were
/// measured against it, but neither its translation's nor its rotation's trace falls below what was reported before.
/// All covariances are of right perturbations, T * exp(xi), translation before rotation, in m and rad.
class PoseCovariance {
 public:
  /// Successive key frames see the same points, compensated with the same calibration: their errors are alike, not
  /// independent. The variance of their sum is larger than the sum of their variances by about as many as are alike.
  static constexpr double kAlike = 3.5;

  /// Of the last pose. Zero in the beginning, when that is a key frame by definition.
  const Matrix6d& value() const { return value_; }

  /// A second thought moved the last pose by this right perturbation. Its covariance then contains that.
  void cover(const Vector6d& correction);

  /// The last pose becomes the beginning of a new drive, after a motion of unknown size; it is a key frame. `travelled`
  /// is what may have been travelled unseen.
  void restart(const Matrix6d& travelled = Matrix6d::Zero());

  /// The pose moved on; the motion is known by itself, with a covariance that adds to the last pose's.
  void advance(const Eigen::Isometry3d& T_previous_current, const Matrix6d& covariance);

  /// The pose moved on; the motion is what the adjustment of a window left of it. Returns the motion's covariance.
  Matrix6d advance(const Eigen::Isometry3d& T_previous_current, const WindowCovariances& window);

  /// The last pose may be wrong by more than its measurement says.
  void doubt(const Matrix6d& covariance);

  /// The last pose is a key frame of the map: the next ones are measured from it. Its error since the key frame before
  /// counts `kAlike` times if a window measured it.
  void markKeyframe();

 private:
  Matrix6d outdated(const WindowCovariances& window) const;
  void carry(const Eigen::Isometry3d& T_previous_current);

  Matrix6d value_ = Matrix6d::Zero();
  Matrix6d keyframe_ = Matrix6d::Zero();        ///< the key frame's share of it, as a perturbation of the last pose
  Matrix6d since_keyframe_ = Matrix6d::Zero();  ///< the last pose as seen from the key frame before it
  bool last_is_keyframe_ = true;
  std::optional<WindowCovariances> last_window_;  ///< of the last pose, if a window measured it
};

}  // namespace sdvo
