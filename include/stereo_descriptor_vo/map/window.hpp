#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/map/floor.hpp"
#include "stereo_descriptor_vo/motion/rig_calibration.hpp"

namespace sdvo {

/// A point by its ray and inverse depth in the frame of the camera that saw it first: (x/z, y/z, 1/z). Far points stay
/// well conditioned in this form. The anchor is a constant, not one of the window's poses.
struct AnchoredPoint {
  Eigen::Isometry3d T_origin_anchor = Eigen::Isometry3d::Identity();
  Eigen::Vector3d ray_and_inverse_depth = Eigen::Vector3d::Zero();  ///< -, -, 1/m

  /// The point in a camera's frame, divided by the point's depth in the anchor: finite even for points at infinity.
  Eigen::Vector3d scaledPointIn(const Eigen::Isometry3d& T_camera_origin) const {
    const Eigen::Vector3d ray(ray_and_inverse_depth.x(), ray_and_inverse_depth.y(), 1.0);
    const double inverse_depth = ray_and_inverse_depth.z();
    const Eigen::Vector3d in_origin = T_origin_anchor.linear() * ray + inverse_depth * T_origin_anchor.translation();
    return T_camera_origin.linear() * in_origin + inverse_depth * T_camera_origin.translation();
  }
};

/// One sighting of a point. Rows come from the left view alone: the right view of real rigs is vertically off.
struct WindowObservation {
  int point;
  int frame;
  Eigen::Vector3d measurement;  ///< (u_left, v_left, disparity), px, as measured: the rig's error is not removed
  double sigma;                 ///< standard deviation of u_left and of v_left, px
};

/// Several pairs and the points they share.
struct Window {
  StereoCamera camera;
  std::vector<Eigen::Isometry3d> T_camera_origin;  ///< the first one is held fixed
  std::vector<AnchoredPoint> points;
  std::vector<WindowObservation> observations;  ///< sorted by point
  RigCalibration calibration;
  CalibrationBelief calibration_prior;
  std::optional<Floor> floor;  ///< on which the base of every pose but the first is held
};

}  // namespace sdvo
