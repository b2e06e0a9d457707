#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <rosbag/exceptions.h>
#include <rosbag/message_instance.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <CLI/CLI.hpp>
#include <array>
#include <boost/make_shared.hpp>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "../config/interface_options.hpp"

namespace sdvo {

/// Topics of a stereo camera: left and right image, left and right calibration (the order of ArrivalLog::Input).
using StereoTopics = std::array<std::string, 4>;

/// Where the images and the calibration of a recorded or live stereo camera are, as options of a command line.
struct StereoSource {
  std::string camera = "/stereo", left = "left", right = "right", image = "image_rect";
  std::vector<std::string> calibration;  ///< files of readCalibration() in place of camera_info; none: camera_info
  double fov = 0.0;                      ///< of raw images once they are rectified, deg; 0: as calibrated
  std::vector<std::string> images;       ///< topics, left and right; none: by the names above
  std::vector<std::string> infos;        ///< topics of camera_info, left and right; none: beside the images
  PairingOptions pairing;
  double rate = 0.0;                     ///< of a folder's pairs, Hz; 0: as its file of times says

  void addTo(CLI::App& app);
  std::string folder() const;  ///< the namespace, which ends with `/`
  StereoTopics topics() const;
};

/// Topics of a bag's stereo camera. Images that are recorded compressed alone have `/compressed` at the end. If a bag
/// lacks the default names, its only stereo camera is taken, or the only one in the given namespace: a rectified one,
/// else a raw one. Files of a calibration stand for camera_info. Throws std::runtime_error if the bag lacks a topic.
StereoTopics topicsIn(const rosbag::Bag& bag, const StereoSource& source);

/// Throws std::runtime_error if a process of this machine has the file open for writing, such as a recorder. Repairing
/// its bag now would destroy it.
void refuseWhatIsWritten(const std::string& path);

/// Returns the result of `work`. If the bag cannot be read, throws std::runtime_error with its name and a remedy.
template <class Work>
auto ofBag(const std::string& path, const Work& work) try {
  return work();
} catch (const rosbag::BagUnindexedException&) {
  refuseWhatIsWritten(path);
  throw std::runtime_error("'" + path + "' has no index, as of a recorder that was killed: where none runs any more, " +
                           "rosbag reindex '" + path + "'");
} catch (const rosbag::BagException& e) {
  refuseWhatIsWritten(path);
  throw std::runtime_error("'" + path + "' cannot be read: " + e.what() + ". Is it whole? rosbag check '" + path + "'");
}

/// Opens a bag for reading. Throws as ofBag() does, and for files that are no bags of ROS 1. A pipe is none: opening it
/// would block.
void openBag(const std::string& path, rosbag::Bag& bag);

/// Throws std::runtime_error with both definitions if their fields differ in type or order. Names do not count.
void requireLayout(const rosbag::MessageInstance& instance, const std::string& type, const std::string& definition,
                   const std::string& md5);

/// The name of a type as ROS 1 has it, without ROS 2's /msg/.
std::string ros1Type(std::string type);

/// Reads a message by the types of its fields, not by its MD5: bags converted from ROS 2 have other field names, hence
/// another MD5. Null for another type; throws std::runtime_error for another version of this type.
template <class Message>
boost::shared_ptr<Message> readAs(const rosbag::MessageInstance& instance) {
  if (auto message = instance.instantiate<Message>()) return message;
  namespace traits = ros::message_traits;
  const std::string type = traits::datatype<Message>();
  if (ros1Type(instance.getDataType()) != type) return nullptr;
  requireLayout(instance, type, traits::definition<Message>(), traits::md5sum<Message>());
  std::vector<std::uint8_t> bytes(instance.size());
  ros::serialization::OStream out(bytes.data(), instance.size());
  instance.write(out);
  ros::serialization::IStream in(bytes.data(), instance.size());
  const auto message = boost::make_shared<Message>();
  ros::serialization::deserialize(in, *message);
  return message;
}

/// A message of one of the topics: an image or a calibration.
struct StereoMessage {
  std_msgs::Header header;
  std::size_t input;  ///< which of the topics
  ros::Time arrival;  ///< or when it was recorded
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info;
  std::shared_ptr<const rosbag::MessageInstance> recorded = nullptr;  ///< where the bag has it; null: live
};

}  // namespace sdvo

/// By which message_filters finds the stamp.
template <>
struct ros::message_traits::HasHeader<sdvo::StereoMessage> : TrueType {};

namespace sdvo {

/// From an image or a camera_info.
inline StereoMessage toStereoMessage(std::size_t input, const ros::Time& arrival,
                                     const sensor_msgs::ImageConstPtr& image) {
  return {image->header, input, arrival, image, nullptr};
}
inline StereoMessage toStereoMessage(std::size_t input, const ros::Time& arrival,
                                     const sensor_msgs::CameraInfoConstPtr& info) {
  return {info->header, input, arrival, nullptr, info};
}

/// A compressed image becomes a raw one; without pixels where it cannot be decoded. Throws std::runtime_error for
/// another type of message.
StereoMessage readStereoMessage(const rosbag::MessageInstance& instance, const StereoTopics& topics);

}  // namespace sdvo
