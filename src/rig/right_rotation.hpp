#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "../motion/correspondence_arrays.hpp"
#include "../motion/noise.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Measured rotation w of the right camera, rad about the axes of the left optical frame. It moves the right view by
/// (du, dv), px, where (x, y) are normalised coordinates in the right image.
///   du = f * (w_x * x * y - w_y * (1 + x^2) + w_z * y),  dv = f * (w_x * (1 + y^2) - w_y * x * y - w_z * x).
struct RightRotation {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  /// Sandwich (White 1980) over parts of the image, within which errors are correlated.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Covariance, rad^2, by errors of rectification of 1 px (root mean square). It is that of random rotations
  /// which shift the measured disparities or rows by as much, with a covariance of the same shape as by noise.
  Eigen::Matrix3d by_pixel = Eigen::Matrix3d::Zero();
};

/// Derivative of (du, dv), px, by the rotation, rad, at a position in the right image, px.
Eigen::Matrix<double, 2, 3> rotationJacobian(const StereoCamera& camera, double u, double v);

/// The features as the right camera would have seen them without the rotation.
StereoFeatures rotatedBack(const StereoFeatures& features, const Eigen::Vector3d& rotation);

/// Rotation about the vertical axis by which disparities differ from those under a motion (median over the matches). It
/// is where a search begins if no motion explains both views.
Eigen::Vector3d yawByDisparities(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
                                 const Eigen::Isometry3d& T_current_reference);

/// Rotation of the right camera since the reference, from the disparities of a motion's inliers. Motion and rotation
/// are estimated together. Rows are not used: rectification distorts them (RowPattern). None with too few inliers.
std::optional<RightRotation> rotationByDisparities(const StereoCamera& camera, const NoiseOptions& noise,
                                                   const std::vector<Correspondence>& correspondences,
                                                   const std::vector<int>& inliers,
                                                   const Eigen::Isometry3d& T_current_reference);

}  // namespace sdvo
