#pragma once

#include <ros/datatypes.h>
#include <ros/master.h>
#include <ros/node_handle.h>

#include <string>
#include <vector>

namespace sdvo {

/// Usual names of rectified images, best ones for features first.
extern const std::vector<std::string> kRectifiedImages;

bool isAmong(const ros::master::V_TopicInfo& topics, const std::string& name);

/// Stereo cameras under a namespace (which ends with `/`): a left and a right image of one of these names with a
/// camera_info beside each. Each camera as remappings of left|right/image_rect and left|right/camera_info.
std::vector<ros::M_string> findStereoCameras(const std::string& ns, const ros::master::V_TopicInfo& topics,
                                             const std::vector<std::string>& images = kRectifiedImages);

/// "; " and the left images of all stereo cameras, or if there is none of those with raw images, or nothing.
std::string listStereoCameras(const ros::master::V_TopicInfo& topics);

/// Reports those of the topics that nobody publishes, with a remedy if the compressed ones are published, and the
/// cameras that there are. Each begins with "; ".
std::string explainUnpublished(const std::vector<std::string>& names, const ros::master::V_TopicInfo& topics);

/// Chooses the only stereo camera under a node's namespace while nobody publishes the node's own image topics, and goes
/// back to these once somebody does. Topics that the user remapped stay.
class CameraFinder {
 public:
  /// `ns` of the node; `left` and `right`: its names of the images.
  CameraFinder(const std::string& ns, std::string left, std::string right);

  /// Whether topics are of interest: before the first pairs, and since another camera was chosen, for its driver and the
  /// node's own may take turns.
  bool isSearching(bool has_pairs) const { return !has_pairs || has_chosen_; }

  /// `topics`: those that are published. True if the node must subscribe to other images; `report` has the reason, or
  /// why none was chosen.
  bool update(const ros::master::V_TopicInfo& topics, std::string& report);

  /// Remappings to the chosen camera; empty: the node's own topics.
  const ros::M_string& names() const { return names_; }

  /// The node's handle, with these names.
  ros::NodeHandle handle(const ros::NodeHandle& nh) const;

 private:
  const std::string ns_, left_, right_;
  ros::M_string names_;
  bool has_chosen_ = false;
};

}  // namespace sdvo
