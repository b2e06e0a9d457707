#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "../matching/patch_alignment.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

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

/// Smallest z of a scaled point in front of the camera: its depth divided by its depth in the anchor.
constexpr double kNearestScaled = 1e-3;

/// Measurement of a point by a pair. The vertical position comes from the left view alone: the right view of real rigs
/// is vertically off.
struct Observation {
  Eigen::Vector3d measurement;  ///< (u_left, v_left, disparity), px, as measured: the rig's error is not removed
  double sigma;                 ///< standard deviation of u_left and of v_left, px
};

/// Predicted (u_left, v_left, disparity) in px without the rig's error; nothing when the point is not in front of the
/// camera.
std::optional<Eigen::Vector3d> predictObservation(const StereoCamera& camera, const Eigen::Isometry3d& T_camera_origin,
                                                  const AnchoredPoint& point);

/// The patch that a point's sightings are aligned with, and the point's place in it.
struct ReferencePatch {
  std::vector<std::uint8_t> samples;                                  ///< empty without patches
  float spacing = 1.f;                                                ///< px
  Eigen::Vector2f centre = Eigen::Vector2f::Zero();                   ///< samples from the patch's middle
  Eigen::Isometry3d T_camera_origin = Eigen::Isometry3d::Identity();  ///< of the pair that it was taken from

  /// Takes over a feature's patch and reuses its own memory. The point lies at `position` in the left image, px. The
  /// patch is empty if the features have none.
  void take(const StereoFeatures& features, int feature, const Eigen::Vector2d& position,
            const Eigen::Isometry3d& T_then_origin);

  /// Where the point lies in another pair.
  struct Found {
    Eigen::Vector2d shift;  ///< from the feature's own position, px
    double sigma;           ///< of each coordinate, px
    double scale;           ///< how much larger the point appears than in the reference
  };
  /// Aligns the feature's patch with this one, which is warped by the poses and the point's depth. The pair is seen
  /// from about `T_camera_origin`. Nothing without patches or where they do not agree.
  std::optional<Found> findIn(const NoiseOptions& noise, const StereoFeatures& features, int feature,
                              const Eigen::Isometry3d& T_camera_origin, const AnchoredPoint& point) const;
};

}  // namespace sdvo
