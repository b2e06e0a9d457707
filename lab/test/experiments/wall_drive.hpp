#pragma once

#include "../../../test/synthetic_scene.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

namespace sdvo::synthetic {

/// Writes a drive towards a textured wall, which is 8 m away at first and nearer by `step` (m) from pair to pair.
/// Returns T_world_camera of each pair.
inline Trajectory writeWallDrive(const std::string& folder, int pairs, double step) {
  constexpr double kDepth = 8.0;  // m
  const StereoCamera rig = camera();
  const Texture texture(2, 8.0 * kDepth / rig.fx, 60.0 * kDepth / rig.fx);
  KittiWriter writer(folder);
  std::vector<std::int64_t> stamps;
  Trajectory trajectory;
  for (int i = 0; i < pairs; ++i) {
    for (int side = 0; side < 2; ++side)
      writer.writeImage(side, i, renderPlane(texture, rig, kDepth - i * step, side * rig.baseline));
    stamps.push_back(i * 100000000LL);
    trajectory.push_back(Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, i * step)));
  }
  writer.finish(rig, stamps, trajectory);
  return trajectory;
}

}  // namespace sdvo::synthetic
