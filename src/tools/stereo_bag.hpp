#pragma once

#include <ros/message_traits.h>
#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>

#include <boost/make_shared.hpp>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "../ros/output_files.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

/// A bag that gets its name when it is complete. It replaces no file but an empty one.
class BagWriter {
  template <class Action>
  auto guard(const std::string& what, const Action& action) const {
    try {
      return action();
    } catch (const std::exception& e) {
      throw std::runtime_error(name_ + ": cannot " + what + " (is the disk full?): " + e.what());
    }
  }

 public:
  BagWriter(const std::string& path, const std::string& tool)
      : name_("--output '" + path + "'"), caller_("/" + tool), file_(newFile(path)), bag_(begin()) {}

  template <class Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message) {
    guard("write", [&] { bag_->write(topic, time, message); });
  }

  /// As write(), but `rosbag play` will latch the topic.
  template <class Message>
  void writeLatched(const std::string& topic, const ros::Time& time, const Message& message) {
    const auto header = boost::make_shared<ros::M_string>();
    (*header)["callerid"] = caller_;
    (*header)["latching"] = "1";
    (*header)["type"] = ros::message_traits::datatype<Message>();
    (*header)["md5sum"] = ros::message_traits::md5sum<Message>();
    (*header)["message_definition"] = ros::message_traits::definition<Message>();
    guard("write", [&] { bag_->write(topic, time, message, header); });
  }

  void commit() {
    guard("write", [&] {
      bag_.close();
      file_.commit();
    });
  }

 private:
  static std::string newFile(const std::string& path) {
    const bool is_file = std::filesystem::is_regular_file(path);
    if (is_file && !std::filesystem::is_empty(path))
      throw std::runtime_error("--output '" + path + "' exists and stays: give another name, or remove it");
    return std::filesystem::absolute(path).string();
  }

  OutputBag begin() const {
    return guard("create", [&] { return OutputBag(file_.partial()); });
  }

  const std::string name_, caller_;
  WholeFile file_;
  OutputBag bag_;
};

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
