#include "keyframe_memory.hpp"

#include <algorithm>

namespace sdvo {
namespace {

constexpr double kMost = 0.6;  // ratio of a key frame's points (chosen): a view that has more shows the same place

}  // namespace

int OldKeyframe::sharedWith(const StereoCamera& camera, const Eigen::Isometry3d& T_other_origin) const {
  constexpr double kLargestRatio = 1.1;  // of depths
  const Eigen::Isometry3d T_other_this = T_other_origin * T_camera_origin.inverse();
  int shared = 0;
  for (const Eigen::Vector3d& here : described.positions) {
    const Eigen::Vector3d there = T_other_this * here;
    if (there.z() * kLargestRatio < here.z() || there.z() > kLargestRatio * here.z()) continue;
    if (camera.sees(camera.project(there))) ++shared;
  }
  return shared;
}

void KeyframeMemory::remember(const StereoCamera& camera, OldKeyframe keyframe) {
  const auto sees_the_same = [&](const std::shared_ptr<const OldKeyframe>& old) {
    return keyframe.sharedWith(camera, old->T_camera_origin) > kMost * keyframe.described.count();
  };
  // The newest are the nearest.
  if (capacity_ == 0 || std::any_of(keyframes_.rbegin(), keyframes_.rend(), sees_the_same)) return;
  const Eigen::Vector3d here = keyframe.T_camera_origin.inverse().translation();
  keyframes_.push_back(std::make_shared<OldKeyframe>(std::move(keyframe)));
  if (count() <= capacity_) return;
  const auto distance = [&](const std::shared_ptr<const OldKeyframe>& old) {
    return (old->T_camera_origin.inverse().translation() - here).norm();
  };
  keyframes_.erase(std::max_element(keyframes_.begin(), keyframes_.end(),
                                    [&](const auto& a, const auto& b) { return distance(a) < distance(b); }));
}

const OldKeyframe* KeyframeMemory::nearest(const StereoCamera& camera, const Eigen::Isometry3d& T_camera_origin,
                                           int least) const {
  // Baselines (chosen): from so far away, the error of a disparity moves a point in the image by three times as much.
  constexpr double kFarthest = 3.0;
  const Eigen::Vector3d here = T_camera_origin.inverse().translation();
  const OldKeyframe* nearest = nullptr;
  double least_distance = kFarthest * camera.baseline;
  for (const auto& keyframe : keyframes_) {
    const double distance = (keyframe->T_camera_origin.inverse().translation() - here).norm();
    const double enough = std::max<double>(least, kMost * static_cast<double>(keyframe->points.size()));
    if (distance < least_distance && keyframe->sharedWith(camera, T_camera_origin) >= enough)
      nearest = keyframe.get(), least_distance = distance;
  }
  return nearest;
}

}  // namespace sdvo
