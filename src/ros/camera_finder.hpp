#pragma once

#include <ros/datatypes.h>
#include <ros/master.h>
#include <ros/node_handle.h>

#include <string>
#include <vector>

namespace sdvo {

/// As drivers and image_proc call rectified images, what is best for features first.
extern const std::vector<std::string> kRectifiedImages;

/// The stereo cameras under a namespace (with its last `/`): images of one of these names and a camera_info beside
/// each, left and right named alike. Each as remappings of left|right/image_rect and left|right/camera_info.
std::vector<ros::M_string> findStereoCameras(const std::string& ns, const ros::master::V_TopicInfo& topics,
                                             const std::vector<std::string>& images = kRectifiedImages);

/// Which of these topics nobody publishes, each with a leading "; ", and what to do where it comes compressed.
std::string explainUnpublished(const std::vector<std::string>& names, const ros::master::V_TopicInfo& topics);

/// Takes the only stereo camera under a node's namespace while nobody publishes images under the node's own names, and
/// gives it back once somebody does. Names that the user chose stay.
class CameraFinder {
 public:
  /// `ns` of the node; `left` and `right`: its names of the images.
  CameraFinder(const std::string& ns, std::string left, std::string right);

  /// Looks at what is published. True where other images are to be used from now on; `report` says why, or what keeps
  /// from it.
  bool update(const ros::master::V_TopicInfo& topics, std::string& report);

  /// Remappings of the camera in use; empty: it is the node's own.
  const ros::M_string& names() const { return names_; }

  /// The node's handle, with these names.
  ros::NodeHandle handle(const ros::NodeHandle& nh) const;

 private:
  const std::string ns_, left_, right_;
  ros::M_string names_;
};

}  // namespace sdvo
