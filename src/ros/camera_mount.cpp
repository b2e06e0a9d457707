#include "camera_mount.hpp"

#include <ros/init.h>
#include <ros/time.h>

namespace sdvo {

std::optional<Eigen::Isometry3d> CameraMount::find(const std::string& base_frame, const std::string& camera_frame,
                                                   std::string& problem) {
  if (knows(base_frame, camera_frame)) return last();
  const auto give_up = ros::SteadyTime::now() + ros::WallDuration(has_waited_ ? 0.0 : timeout_);
  has_waited_ = true;
  for (;;) {
    const std::optional<Eigen::Isometry3d> found = transforms_.find(base_frame, camera_frame, problem);
    if (found) {
      base_frame_ = base_frame;
      camera_frame_ = camera_frame;
      const std::lock_guard<std::mutex> lock(mutex_);
      return T_base_camera_ = found;
    }
    if (ros::SteadyTime::now() >= give_up || stopping_ || !ros::ok()) return std::nullopt;
    ros::WallDuration(0.01).sleep();
  }
}

bool CameraMount::knows(const std::string& base_frame, const std::string& camera_frame) const {
  return last() && base_frame == base_frame_ && camera_frame == camera_frame_;
}

std::optional<Eigen::Isometry3d> CameraMount::last() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return T_base_camera_;
}

}  // namespace sdvo
