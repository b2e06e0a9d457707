#pragma once

#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>

#include <string>
#include <vector>

#include "bag_writer.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

/// A recorded stereo drive as a bag: pairs of images with their calibrations under /stereo, /tf_static from base_link
/// to both cameras and, where the poses are known, /ground_truth/path and /ground_truth/odom.
class StereoBag {
 public:
  /// `camera`: of the rectified views; `camera_poses`: those of the rectified left one at each stamp, or none.
  StereoBag(const std::string& path, const std::string& tool, std::vector<ros::Time> stamps, const StereoCamera& camera,
            const Trajectory& camera_poses);

  /// Pair i as left|right/`image_topic` with its calibrations, whose headers are filled here.
  void write(std::size_t i, const std::string& image_topic, const ImagePair& pair, sensor_msgs::CameraInfo left,
             sensor_msgs::CameraInfo right);

  /// The bag appears under its name.
  void commit() { bag_.commit(); }

 private:
  BagWriter bag_;
  std::vector<ros::Time> stamps_;
  Trajectory base_poses_;  ///< in the odom frame, which is the base's frame at the first stamp
};

}  // namespace sdvo
