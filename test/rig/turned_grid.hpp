#pragma once

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// A grid of features with large disparities, whose vertical ones come from turning the right camera by `rotation`: the
/// rays themselves are turned. Disparities are as before.
inline StereoFeatures gridSeenWith(const Eigen::Vector3d& rotation) {
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  const StereoCamera& camera = features.camera;
  for (int row = 0; row < 9; ++row)
    for (int column = 0; column < 12; ++column) {
      const float u = 140.f + 40.f * static_cast<float>(column), v = 30.f + 50.f * static_cast<float>(row);
      const float disparity = 60.f + 10.f * static_cast<float>((row + column) % 5);
      const Eigen::Vector3d ray((u - disparity - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
      const Eigen::Vector3d turned = expSO3(-rotation) * ray;
      const auto dv = static_cast<float>(camera.fy * (turned.y() / turned.z() - ray.y()));
      features.append({u, v, disparity, dv, 10.f, -1.f, 1.f});
    }
  return features;
}

}  // namespace sdvo
