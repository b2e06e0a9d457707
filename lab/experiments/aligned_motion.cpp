#include "aligned_motion.hpp"

#include <numeric>
#include <optional>

#include "../../src/map/map_point.hpp"

namespace sdvo {
namespace {

/// Where the reference's point lies in the current pair, px from the row's own position.
std::optional<Eigen::Vector2d> findShift(const StereoFeatures& reference, const StereoFeatures& current,
                                         const FeatureMatch& match, PatchWarp warp,
                                         const Eigen::Isometry3d& T_current_reference) {
  const NoiseOptions noise;
  if (warp == PatchWarp::kNone) {
    const auto patchOf = [](const StereoFeatures& features, int feature) {
      return Patch{features.patches.ptr(feature), features.patch_layout.side,
                   features.patch_layout.spacing(features.size[feature])};
    };
    const auto found = alignPatch(noise, patchOf(reference, match.reference), Eigen::Vector2f::Zero(),
                                  patchOf(current, match.current), Eigen::Matrix2f::Identity());
    return found ? std::optional<Eigen::Vector2d>(found->shift.cast<double>()) : std::nullopt;
  }
  const Eigen::Vector2d corner(reference.u[match.reference], reference.v[match.reference]);
  const Eigen::Vector3d p = reference.point(match.reference);
  const AnchoredPoint point{Eigen::Isometry3d::Identity(), {p.x() / p.z(), p.y() / p.z(), 1.0 / p.z()}};
  ReferencePatch patch;
  patch.take(reference, match.reference, corner, Eigen::Isometry3d::Identity());
  const auto found = patch.findIn(noise, current, match.current, T_current_reference, point);
  return found ? std::optional<Eigen::Vector2d>(found->shift) : std::nullopt;
}

}  // namespace

Eigen::Isometry3d alignedMotion(const MotionEstimatorOptions& options, const StereoFeatures& reference,
                                const StereoFeatures& current, const std::vector<FeatureMatch>& inliers, PatchWarp warp,
                                const Eigen::Isometry3d& T_current_reference) {
  constexpr std::size_t kEnough = 30;  // fewer are no better than all corners together
  std::vector<Correspondence> aligned;
  for (const FeatureMatch& match : inliers) {
    const auto shift = findShift(reference, current, match, warp, T_current_reference);
    // The disparity was measured at the corner; it goes with it.
    if (shift)
      aligned.push_back({reference.point(match.reference),
                         current.measurement(match.current) + Eigen::Vector3d(shift->x(), shift->y(), shift->x())});
  }
  Eigen::Isometry3d T = T_current_reference;
  if (aligned.size() < kEnough) return T;
  std::vector<int> all(aligned.size());
  std::iota(all.begin(), all.end(), 0);
  refineMotion(current.camera, options, aligned, all, T);
  return T;
}

}  // namespace sdvo
