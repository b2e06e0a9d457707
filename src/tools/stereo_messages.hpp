#pragma once

#include <rosbag/bag.h>
#include <rosbag/exceptions.h>
#include <rosbag/message_instance.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace sdvo {

/// Topics of a rectified stereo camera: left and right image, left and right calibration (the order of
/// ArrivalLog::Input).
using StereoTopics = std::array<std::string, 4>;

/// The names that the topics are made of, as options of a command line.
struct StereoNames {
  std::string camera = "/stereo", left = "left", right = "right", image = "image_rect";

  /// `scope` begins what --help has of them.
  void addTo(CLI::App& app, const std::string& scope = "bags: ");
  StereoTopics topics() const;
};

/// The topics as a bag has them: …/compressed where an image is recorded in that form alone. Where it has none of the
/// usual names, those of its only stereo camera, or of the only one in the namespace that is given.
StereoTopics topicsIn(const rosbag::Bag& bag, const StereoNames& names);

/// Throws std::runtime_error where a process of this machine has the file open to write it, as a recorder has: what
/// repairs a bag would ruin it.
void refuseWhatIsWritten(const std::string& path);

/// What `work` returns. Throws std::runtime_error that names the bag, and the remedy where there is one, when the bag
/// cannot be read.
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

/// For reading. Throws as ofBag() does; a pipe, which would be waited for, is none.
void openBag(const std::string& path, rosbag::Bag& bag);

/// A message of one of the topics: an image or a calibration.
struct StereoMessage {
  std::size_t input;  ///< which of the topics
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info;

  const std_msgs::Header& header() const { return image ? image->header : info->header; }
};

/// A compressed image becomes a raw one; without pixels where it cannot be decoded. Throws std::runtime_error for
/// another type of message.
StereoMessage readStereoMessage(const rosbag::MessageInstance& instance, const StereoTopics& topics);

}  // namespace sdvo
