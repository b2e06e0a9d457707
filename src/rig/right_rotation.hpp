#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/motion/correspondence_arrays.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {

/// A rotation w of the right camera, rad about the axes of the left optical frame, as a measurement has it. The
/// right view moves by (du, dv), where (x, y) are normalised coordinates in the right image.
///   du = f * (w_x * x * y - w_y * (1 + x^2) + w_z * y),  dv = f * (w_x * (1 + y^2) - w_y * x * y - w_z * x).
struct RightRotation {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  /// Sandwich (White 1980) over parts of the image: errors within a part are alike.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Covariance of a rotation that shifts what was measured by 1 px (root mean square).
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
};

/// Derivative of (du, dv), px, by the rotation at a position of the right image, px.
Eigen::Matrix<double, 2, 3> rotationJacobian(const StereoCamera& camera, double u, double v);

/// The features as the right camera saw them before it rotated.
StereoFeatures rotatedBack(const StereoFeatures& features, const Eigen::Vector3d& rotation);

/// The right camera's rotation since the reference, by the disparities of a motion's inliers: the motion and the
/// rotation are estimated together. Rows are left out, since they have a pattern of their own. None of too few points.
std::optional<RightRotation> rotationByDisparities(const StereoCamera& camera, const NoiseOptions& noise,
                                                   const std::vector<Correspondence>& correspondences,
                                                   const std::vector<int>& inliers,
                                                   const Eigen::Isometry3d& T_current_reference);

}  // namespace sdvo
