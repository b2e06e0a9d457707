#pragma once

#include <Eigen/Geometry>
#include <string>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

using Vector6d = Eigen::Matrix<double, 6, 1>;  ///< (translation, rotation), the order of ROS' 6x6 covariances
using Matrix6d = Eigen::Matrix<double, 6, 6>;

Eigen::Matrix3d skew(const Eigen::Vector3d& w);
Eigen::Matrix3d expSO3(const Eigen::Vector3d& w);
Eigen::Vector3d logSO3(const Eigen::Matrix3d& rotation);
/// The angle of a rotation, deg from 0 to 180.
double degreesOf(const Eigen::Matrix3d& rotation);

/// The left Jacobian V of SO(3): exp((rho, phi)) has the translation V(phi) * rho (Barfoot, State Estimation,
/// eq. 7.86).
Eigen::Matrix3d leftJacobianSO3(const Eigen::Vector3d& phi);

Eigen::Isometry3d expSE3(const Vector6d& xi);
Vector6d logSE3(const Eigen::Isometry3d& T);

/// Ad(T): T exp(xi) = exp(Ad(T) xi) T.
Matrix6d adjoint(const Eigen::Isometry3d& T);

/// Covariance of Ad(T) xi from that of xi: of a left perturbation of a motion from that of a right one, for example.
Matrix6d carried(const Eigen::Isometry3d& T, const Matrix6d& covariance);

/// Covariance of independent errors, the same along all axes; m^2 and rad^2.
Matrix6d isotropic(double translation_variance, double rotation_variance);

/// The squared Mahalanobis distance: chi-square with six degrees of freedom if the difference is Gaussian with this
/// covariance.
double mahalanobisSquare(const Vector6d& difference, const Matrix6d& covariance);

/// A symmetric matrix with its negative eigenvalues set to zero. A difference of covariances may have such.
Matrix6d positivePart(const Matrix6d& matrix);

/// Throws std::invalid_argument that says what is not a rigid motion of finite numbers.
void checkRigid(const Eigen::Isometry3d& T, const std::string& what);

/// The same pose with its rotation made orthonormal again; products of many rotations drift away from that.
Eigen::Isometry3d orthonormalised(const Eigen::Isometry3d& T);

}  // namespace sdvo
