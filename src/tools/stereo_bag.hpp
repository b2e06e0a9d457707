#pragma once

#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>

#include <string>
#include <vector>

#include "../ros/output_files.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

/// A recorded stereo drive as a bag: pairs of images with their calibrations under /stereo, /tf_static from base_link
/// to both cameras and, where the poses are known, /ground_truth/path and /ground_truth/odom. It gets its name when it
/// is complete, and replaces no file but an empty one. Throws std::runtime_error that names the file.
class StereoBag {
 public:
  /// `camera`: of the rectified views; `camera_poses`: those of the rectified left one at each stamp, or none.
  StereoBag(const std::string& path, const std::string& tool, std::vector<ros::Time> stamps, const StereoCamera& camera,
            const Trajectory& camera_poses);

  /// Pair i as left|right/`image_topic` with its calibrations, whose headers are filled here.
  void write(std::size_t i, const std::string& image_topic, const ImagePair& pair, sensor_msgs::CameraInfo left,
             sensor_msgs::CameraInfo right);

  /// The bag is complete.
  void commit();

 private:
  template <class Action>
  auto guard(const std::string& what, const Action& action) const;
  template <class Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message);
  /// `rosbag play` will latch the topic.
  template <class Message>
  void writeLatched(const std::string& topic, const ros::Time& time, const Message& message);

  const std::string name_, caller_;
  WholeFile file_;
  OutputBag bag_;
  std::vector<ros::Time> stamps_;
  Trajectory base_poses_;  ///< in the odom frame, which is the base's frame at the first stamp
};

}  // namespace sdvo
