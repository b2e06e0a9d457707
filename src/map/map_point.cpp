#include "map_point.hpp"

namespace sdvo {

std::optional<Eigen::Vector3d> predictObservation(const StereoCamera& camera, const Eigen::Isometry3d& T_camera_origin,
                                                  const AnchoredPoint& point) {
  const Eigen::Vector3d P = point.scaledPointIn(T_camera_origin);
  if (P.z() < kNearestScaled) return std::nullopt;
  const double iz = 1.0 / P.z();
  const double x = P.x() * iz, y = P.y() * iz, fb = camera.fx * camera.baseline;
  return Eigen::Vector3d{camera.fx * x + camera.cx, camera.fy * y + camera.cy,
                         fb * point.ray_and_inverse_depth.z() * iz};
}

void ReferencePatch::take(const StereoFeatures& features, int feature, const Eigen::Vector2d& position,
                          const Eigen::Isometry3d& T_then_origin) {
  T_camera_origin = T_then_origin;
  samples.clear(), spacing = 1.f, centre.setZero();
  if (!features.hasPatches()) return;
  const std::uint8_t* first = features.patches.ptr(feature);
  samples.assign(first, first + features.patches.cols);
  spacing = features.patch_layout.spacing(features.size[feature]);
  centre = (position - Eigen::Vector2d(features.u[feature], features.v[feature])).cast<float>() / spacing;
}

std::optional<ReferencePatch::Found> ReferencePatch::findIn(const NoiseOptions& noise, const StereoFeatures& features,
                                                            int feature, const Eigen::Isometry3d& T_now_origin,
                                                            const AnchoredPoint& point) const {
  if (!canAlign(features.patch_layout.side) ||
      samples.size() != static_cast<std::size_t>(features.patch_layout.bytes()))
    return std::nullopt;

  // Assumes that the patch is small and parallel to the image that it was taken from. To first order an affine map then
  // leads to the other view; its main part is the ratio of the depths.
  const Eigen::Vector3d then = point.scaledPointIn(T_camera_origin);
  const Eigen::Vector3d now = point.scaledPointIn(T_now_origin);
  if (then.z() < kNearestScaled || now.z() < kNearestScaled) return std::nullopt;
  const Eigen::Matrix3d R = T_now_origin.linear() * T_camera_origin.linear().transpose();
  const Eigen::Vector2d ray = now.head<2>() / now.z();
  const double scale = then.z() / now.z();
  const Eigen::Matrix2d warp = scale * (R.topLeftCorner<2, 2>() - ray * R.bottomLeftCorner<1, 2>());

  const int side = features.patch_layout.side;
  const Patch old_patch{samples.data(), side, spacing};
  const Patch new_patch{features.patches.ptr(feature), side, features.patch_layout.spacing(features.size[feature])};
  const auto found = alignPatch(noise, old_patch, centre, new_patch, warp.cast<float>());
  if (!found) return std::nullopt;
  return Found{found->shift.cast<double>(), found->sigma, scale};
}

}  // namespace sdvo
