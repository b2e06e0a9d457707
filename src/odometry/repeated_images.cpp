#include "stereo_descriptor_vo/odometry/repeated_images.hpp"

#include <cmath>

namespace sdvo {

bool RepeatedImages::areFrozen(const StereoFeatures& features,
                               const std::optional<Eigen::Isometry3d>& T_previous_current, bool is_measured) const {
  constexpr double kSeen = 1.0;  // px (chosen: beyond the noise of corners) by which most points should have moved
  if (features.count() == 0 || features_[0] != features.u || features_[1] != features.v ||
      features_[2] != features.disparity)
    return false;
  if (!is_measured && frozen_) return true;
  if (!T_previous_current) return false;
  const Eigen::Isometry3d T_current_previous = T_previous_current->inverse();
  int moved = 0;
  for (int i = 0; i < features.count(); ++i) {
    const Eigen::Vector3d point = features.camera.backProject(features.u[i], features.v[i], features.disparity[i]);
    const Eigen::Vector3d now = features.camera.project(T_current_previous * point);
    moved += std::hypot(now.x() - features.u[i], now.y() - features.v[i]) > kSeen;
  }
  return 2 * moved > features.count();
}

void RepeatedImages::remember(const StereoFeatures& features, bool frozen) {
  features_ = {features.u, features.v, features.disparity};
  frozen_ = frozen;
}

}  // namespace sdvo
