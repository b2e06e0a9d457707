#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/motion/rig_calibration.hpp"

namespace sdvo {

/// The addition that lets a covariance explain a deviation: its outer product, and the ratio by which a motion may err
/// in every direction. Zero where the deviation's square is at most half of the expected one (chi-square of six).
Matrix6d lacking(const Matrix6d& covariance, const Vector6d& deviation);

/// Covariance of a pose that is reported pair by pair while the map behind it improves. All covariances are of right
/// perturbations, T * exp(xi), translation before rotation, in m and rad.
///
/// The pose's covariance is the sum of two parts. One is of the pose as it was measured last: the key frame's, and what
/// the pose errs by more in the map. The other is of motions that were predicted or doubted since. The measured part
/// grows from key frame to key frame, but not while the map stays the same: its traces of translation and rotation
/// never shrink. A new measurement replaces the doubted part. Parts are only added, so the sum is positive whatever its
/// size.
///
/// All motions have the error of the rig in common. It adds up with the distance, unlike their noise, and is followed
/// apart: as the pose's derivative by the rig.
class PoseCovariance {
 public:
  /// Of the last pose, the rig's error apart; zero in the beginning.
  Matrix6d value() const { return measured_ + doubted_; }

  /// Moment of the last pose's error by the rig's: by how far `known` is from what was compensated on the way, and by
  /// its covariance.
  Matrix6d byRig(const RigEstimate& known) const;

  /// The map moved the last pose by this right perturbation: its covariance then contains that.
  void cover(const Vector6d& correction);

  /// The last pose, and all that are measured in the same map, may be off by more.
  void spread(const Matrix6d& moment) {
    measured_ += moment;
    keyframe_ += moment;
  }

  /// The last pose is another one now, with this covariance: the key frame of a new drive.
  void assume(const Matrix6d& covariance) {
    *this = PoseCovariance();
    measured_ = keyframe_ = covariance;
  }

  /// The pose moved on by a motion with a covariance of its own, as a predicted one.
  void advance(const Eigen::Isometry3d& T_previous_current, const Matrix6d& covariance);

  /// The pose moved on and was measured against the key frame with the covariance `since_keyframe`. `growth`:
  /// covariance of its error in the map beyond the key frame's. Returns the covariance of the motion between the two
  /// reported poses. If the pose before is that of the key frame, it is `since_keyframe`. Else the key frame's own
  /// noise is in both poses and cancels. It is as large as that of the better pose, because its points have been seen
  /// as often. So the sum less twice this is the larger one of the two covariances. What the pose before was predicted
  /// or doubted by comes on top.
  Matrix6d measure(const Eigen::Isometry3d& T_previous_current, const Matrix6d& since_keyframe, const Matrix6d& growth);
  /// The key frame is all of the map.
  Matrix6d measure(const Eigen::Isometry3d& T_previous_current, const Matrix6d& since_keyframe) {
    return measure(T_previous_current, since_keyframe, since_keyframe);
  }

  /// The pose that was measured last depends on the rig by this right perturbation since the key frame.
  void expose(const RigEstimate::MotionJacobian& since_keyframe, const RigEstimate::Vector& compensated);

  /// The last motion, and the last pose, may be off by more than their measurement says. The next pose that is measured
  /// in the map takes that back.
  void doubt(const Matrix6d& motion, const Matrix6d& pose);

  /// The last pose is a key frame of the map: the next ones are measured against it, whatever it was doubted by.
  void markKeyframe();

 private:
  /// Derivatives by the rig; last column: less their sum times what was compensated.
  using Exposure = Eigen::Matrix<double, 6, RigEstimate::kParameters + 1>;

  void carry(const Eigen::Isometry3d& T_previous_current);

  Matrix6d measured_ = Matrix6d::Zero();    ///< of the last measured pose, as a perturbation of the last pose
  Matrix6d doubted_ = Matrix6d::Zero();     ///< of motions since then, and of its doubt
  Matrix6d keyframe_ = Matrix6d::Zero();    ///< of the key frame, as a perturbation of the last pose
  std::optional<Matrix6d> since_keyframe_;  ///< of the last pose, as it was measured; none where it is the key frame
  Matrix6d unmeasured_ = Matrix6d::Zero();  ///< of these motions alone, and of what the last one was doubted by
  Exposure exposure_ = Exposure::Zero();
  Exposure keyframe_exposure_ = Exposure::Zero();  ///< as a perturbation of the last pose
};

}  // namespace sdvo
