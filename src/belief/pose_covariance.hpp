#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "../motion/rig_calibration.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// The covariance to add so that the sum explains a deviation: its outer product, and kTolerableRatio of it in every
/// direction, as the deviation's own direction errs. Zero if its squared Mahalanobis distance is at most half of the
/// mean (chi-square of six).
Matrix6d missingCovariance(const Matrix6d& covariance, const Vector6d& deviation);

/// Covariance of a pose that is reported pair by pair while its map is corrected. All covariances are of right
/// perturbations, T * exp(xi), translation before rotation, in m and rad.
///
/// It is the sum of a measured and an unmeasured part. The measured part is the key frame's covariance, and the growth
/// of the pose's covariance in the map since. It grows from key frame to key frame, but not while the map stays the
/// same; its traces of translation and rotation never shrink. Predictions and doubts since the last measurement are the
/// unmeasured part, which the next measurement replaces. Parts are only added, so the covariance stays positive
/// semidefinite.
///
/// The rig's error is common to all motions: unlike noise it adds up with the distance. Pose and rig are one Gaussian
/// with a cross-covariance (Schmidt 1966: the pose considers what it cannot observe), kept as the rig's distribution,
/// which CalibrationFilter has, and the pose's given the rig: its derivative by the rig (the exposure) and what
/// remains.
class PoseCovariance {
 public:
  /// Of the last pose without the rig's error; zero in the beginning.
  Matrix6d value() const { return measured_ + pose_doubt_; }

  /// Second moment of the last pose's error by the rig: the covariance of `known`, and its distance from what was
  /// compensated on the way.
  Matrix6d byRig(const RigEstimate& known) const { return momentOf(exposure_, known); }

  /// The map corrected the last pose by this right perturbation: widens the covariance to explain it.
  void coverCorrection(const Vector6d& correction);

  /// Widens the last pose and all poses that are measured in the same map.
  void inflate(const Matrix6d& moment) {
    measured_ += moment;
    keyframe_ += moment;
  }

  /// The last pose is set, with this covariance, as the key frame of a new map.
  void reset(const Matrix6d& covariance) {
    *this = PoseCovariance();
    measured_ = keyframe_ = covariance;
  }

  /// The last pose is the key frame of a new map. All that is unknown of it, the rig's part as well, is in all poses
  /// that are measured in that map.
  void beginMap();

  /// The pose moved by an unmeasured motion of this covariance, as a prediction.
  void predict(const Eigen::Isometry3d& T_previous_current, const Matrix6d& covariance);

  /// The pose moved and was measured against the key frame with the covariance `since_keyframe`. `growth`: by how much
  /// its covariance in the map exceeds the key frame's. Returns the covariance of the motion between the two reported
  /// poses. After a key frame, this is `since_keyframe`. Otherwise the covariances since the key frame are K + A of the
  /// pose before and K + B of this one, with the noise K of the key frame's own measurement, which cancels in the
  /// motion: A + B. K is unknown, but key frame and pairs see the same points with like noise: if K is the smaller of A
  /// and B, then A + B is the larger of K + A and K + B, and that is returned. Predictions and doubts of the previous
  /// pose are added.
  Matrix6d update(const Eigen::Isometry3d& T_previous_current, const Matrix6d& since_keyframe, const Matrix6d& growth);
  /// The same in a map of one key frame.
  Matrix6d update(const Eigen::Isometry3d& T_previous_current, const Matrix6d& since_keyframe) {
    return update(T_previous_current, since_keyframe, since_keyframe);
  }

  /// To be called after update(), which moves the exposure to the new pose.
  /// Derivative of the last measured pose by the rig since the key frame (right perturbation), and the rig that was
  /// compensated. Returns the second moment that the `known` rig has in the motion between the two reported poses.
  Matrix6d updateExposure(const RigEstimate::MotionJacobian& since_keyframe, const RigEstimate& known,
                          const RigEstimate::Vector& compensated);

  /// The rig walked by a random step of this covariance after it was `known`. Poses depend on the rig before the step,
  /// which correlates with the rig after it.
  void walkRig(const RigEstimate& known, const RigEstimate::Matrix& step);
  /// The rig is another one, independent of the one that was `known`.
  void changeRig(const RigEstimate& known) { expressByNewRig(known, RigEstimate::Matrix::Zero()); }

  /// Adds second moments of doubt to the last motion and pose, until the next pose is measured in the map.
  void addDoubt(const Matrix6d& motion, const Matrix6d& pose);

  /// The last pose is a key frame: the next ones are measured against it, without its doubt.
  void markKeyframe();

 private:
  /// Derivatives of a pose by the rig; last column: minus what the compensated rig has contributed. The error is then
  /// derivative * rig + last column.
  using Exposure = Eigen::Matrix<double, 6, RigEstimate::kParameters + 1>;

  static Matrix6d momentOf(const Exposure& exposure, const RigEstimate& known);
  void carry(const Eigen::Isometry3d& T_previous_current);
  /// `kept`: regression of the old rig on the new one.
  void expressByNewRig(const RigEstimate& known, const RigEstimate::Matrix& kept);

  Matrix6d measured_ = Matrix6d::Zero();      ///< of the last measured pose, in the last pose's frame
  Matrix6d pose_doubt_ = Matrix6d::Zero();    ///< of the pose by predictions and doubts since then
  Matrix6d keyframe_ = Matrix6d::Zero();      ///< of the key frame, in the last pose's frame
  std::optional<Matrix6d> since_keyframe_;    ///< of the last measured motion; none at the key frame
  Matrix6d motion_doubt_ = Matrix6d::Zero();  ///< of the motion since the last measured pose
  Exposure exposure_ = Exposure::Zero();
  Exposure keyframe_exposure_ = Exposure::Zero();  ///< in the last pose's frame
};

}  // namespace sdvo
