#pragma once

#include <nav_msgs/Path.h>
#include <rosbag/bag.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "../../common/whole_file.hpp"

namespace sdvo {

/// A bag being written. rosbag's own destructor writes the index, and terminates the process if that fails on a full
/// disk.
class OutputBag {
 public:
  /// Throws rosbag::BagException when the file cannot be made.
  explicit OutputBag(const std::string& path)
      : path_(path), bag_(std::make_unique<rosbag::Bag>(path, rosbag::bagmode::Write)) {}

  /// Without close() the file is left empty.
  ~OutputBag() {
    if (closed_) return;
    std::error_code ignored;
    std::filesystem::resize_file(path_, 0, ignored);  // makes room for what close() writes
    try {
      bag_->close();
    } catch (const std::exception&) {
      // Never destroyed. The static pointer keeps leak checkers from reporting it.
      [[maybe_unused]] static rosbag::Bag* volatile left_behind;
      left_behind = bag_.release();
    }
  }
  OutputBag(const OutputBag&) = delete;
  OutputBag& operator=(const OutputBag&) = delete;

  rosbag::Bag* operator->() { return bag_.get(); }

  /// Throws rosbag::BagException when the bag is not complete.
  void close() {
    bag_->close();
    closed_ = true;
  }

 private:
  std::string path_;
  std::unique_ptr<rosbag::Bag> bag_;
  bool closed_ = false;
};

/// The one spelling of a file's path. Relative paths begin in ROS_HOME (~/.ros), where roslaunch starts nodes.
std::string inRosHome(const std::string& path);

/// Writes the poses of the base as SaveTrajectory.srv describes it. A file appears whole or not at all. Throws
/// std::runtime_error that names the file, and leaves it as it was, when the format is unknown, the path is not
/// absolute, leads to something else than a file, or may not be written.
void saveTrajectory(const nav_msgs::Path& poses, const Eigen::Isometry3d& T_base_camera, const std::string& format,
                    const std::string& path);

}  // namespace sdvo
