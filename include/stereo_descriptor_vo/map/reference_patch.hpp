#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/map/window.hpp"
#include "stereo_descriptor_vo/matching/patch_alignment.hpp"

namespace sdvo {

/// The patch that a point's sightings are aligned with, and the point's place in it.
struct ReferencePatch {
  std::vector<std::uint8_t> samples;                                  ///< empty without patches
  float spacing = 1.f;                                                ///< px
  Eigen::Vector2f centre = Eigen::Vector2f::Zero();                   ///< samples from the patch's middle
  Eigen::Isometry3d T_camera_origin = Eigen::Isometry3d::Identity();  ///< of the pair that it was taken from

  ReferencePatch() = default;
  /// A row's patch; the point lies at `position` of its left image, px. Empty where the features have no patches.
  ReferencePatch(const StereoFeatures& features, int row, const Eigen::Vector2d& position,
                 const Eigen::Isometry3d& T_then_origin);
  /// Becomes such a patch, in the memory that it has.
  void take(const StereoFeatures& features, int row, const Eigen::Vector2d& position,
            const Eigen::Isometry3d& T_then_origin);

  /// Where the reference's point lies in another pair.
  struct Found {
    Eigen::Vector2d shift;  ///< from the row's own position, px
    double sigma;           ///< of each coordinate, px
    double scale;           ///< how much larger the point appears than in the reference
  };
  /// Aligns the row's patch with this one, which is warped by the poses and the point's depth. The pair is seen from
  /// about `T_camera_origin`. Nothing without patches or where they do not agree.
  std::optional<Found> findIn(const PatchAlignmentOptions& options, const StereoFeatures& features, int row,
                              const Eigen::Isometry3d& T_camera_origin, const AnchoredPoint& point) const;
};

}  // namespace sdvo
