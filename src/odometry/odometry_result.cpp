#include "stereo_descriptor_vo/odometry/odometry_result.hpp"

#include <Eigen/Eigenvalues>

namespace sdvo {
namespace {

std::string defectOf(const char* name, const Eigen::Isometry3d& pose, const Matrix6d& covariance) {
  if (!pose.matrix().allFinite()) return std::string("the ") + name + " is not finite";
  if (!covariance.allFinite()) return std::string("the covariance of the ") + name + " is not finite";
  // By correlations, for m^2 and rad^2 differ in size. Rounding makes eigenvalues negative: the first pose has no
  // error, and an exact simulator's motions almost none.
  constexpr double kRounding = 1e-9;
  const Vector6d variance = covariance.diagonal();
  const Vector6d scale = (variance.array() > 0.0).select(variance.cwiseMax(0.0).cwiseSqrt().cwiseInverse(), 1.0);
  const Matrix6d correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(correlation, Eigen::EigenvaluesOnly);
  if (variance.minCoeff() < 0.0 || solver.eigenvalues().minCoeff() < -kRounding)
    return std::string("the covariance of the ") + name + " is indefinite";
  return "";
}

}  // namespace

std::string OdometryResult::defect() const {
  const std::string of_pose = has_pose ? defectOf("pose", T_origin_camera, pose_covariance) : "";
  return of_pose.empty() && has_motion ? defectOf("motion", T_previous_current, motion_covariance) : of_pose;
}

}  // namespace sdvo
