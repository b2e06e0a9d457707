#include "stereo_descriptor_vo/common/se3.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

namespace sdvo {

Eigen::Matrix3d skew(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
  return m;
}

Eigen::Matrix3d expSO3(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + skew(w);
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

Eigen::Vector3d logSO3(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

double degreesOf(const Eigen::Matrix3d& rotation) {
  return 180.0 / M_PI * Eigen::AngleAxisd(rotation).angle();
}

Eigen::Matrix3d leftJacobianSO3(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  const Eigen::Matrix3d w = skew(phi);
  if (angle < 1e-6) return Eigen::Matrix3d::Identity() + 0.5 * w;
  return Eigen::Matrix3d::Identity() + (1.0 - std::cos(angle)) / (angle * angle) * w +
         (angle - std::sin(angle)) / (angle * angle * angle) * w * w;
}

Eigen::Isometry3d expSE3(const Vector6d& xi) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = expSO3(xi.tail<3>());
  T.translation() = leftJacobianSO3(xi.tail<3>()) * xi.head<3>();
  return T;
}

Vector6d logSE3(const Eigen::Isometry3d& T) {
  Vector6d xi;
  xi.tail<3>() = logSO3(T.linear());
  xi.head<3>() = leftJacobianSO3(xi.tail<3>()).inverse() * T.translation();
  return xi;
}

Matrix6d adjoint(const Eigen::Isometry3d& T) {
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = T.linear();
  ad.bottomRightCorner<3, 3>() = T.linear();
  ad.topRightCorner<3, 3>() = skew(T.translation()) * T.linear();
  return ad;
}

Matrix6d carried(const Eigen::Isometry3d& T, const Matrix6d& covariance) {
  const Matrix6d ad = adjoint(T);
  return ad * covariance * ad.transpose();
}

Matrix6d isotropic(double translation_variance, double rotation_variance) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(translation_variance), Eigen::Vector3d::Constant(rotation_variance);
  return variances.asDiagonal();
}

double mahalanobisSquare(const Vector6d& difference, const Matrix6d& covariance) {
  return difference.dot(covariance.ldlt().solve(difference));
}

Matrix6d positivePart(const Matrix6d& matrix) {
  const double m = matrix.topLeftCorner<3, 3>().norm(), rad = matrix.bottomRightCorner<3, 3>().norm();
  Vector6d unit = Vector6d::Ones();  // scales both blocks to one norm: eigenvectors would mix metres and radians
  if (m > 0.0 && rad > 0.0) unit.head<3>().setConstant(std::sqrt(m / rad));
  const Vector6d inverse = unit.cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(inverse.asDiagonal() * matrix * inverse.asDiagonal());
  const Matrix6d roots =
      unit.asDiagonal() * solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  return Matrix6d((roots * roots.transpose()).selfadjointView<Eigen::Lower>());
}

void checkRigid(const Eigen::Isometry3d& T, const std::string& what) {
  constexpr double kRounding = 1e-3;  // of a quaternion of floats, some times multiplied
  if (!T.matrix().allFinite() || !T.linear().isUnitary(kRounding) || T.linear().determinant() < 0.0)
    throw std::invalid_argument(what + " is not a rigid motion of finite numbers");
}

Eigen::Isometry3d orthonormalised(const Eigen::Isometry3d& T) {
  Eigen::Isometry3d clean = T;
  clean.linear() = Eigen::Quaterniond(T.linear()).normalized().toRotationMatrix();
  return clean;
}

}  // namespace sdvo
