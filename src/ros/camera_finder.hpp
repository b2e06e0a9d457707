#pragma once

#include <ros/master.h>
#include <ros/node_handle.h>

#include <optional>
#include <string>
#include <vector>

namespace sdvo {

/// The stereo cameras under a namespace (with its last `/`): rectified images and a camera_info beside each, left and
/// right named alike. Each as remappings of left|right/image_rect and left|right/camera_info.
std::vector<ros::M_string> findStereoCameras(const std::string& ns, const ros::master::V_TopicInfo& topics);

/// Which of these topics nobody publishes, each with a leading "; ", and what to do where it comes compressed.
std::string explainUnpublished(const std::vector<std::string>& names, const ros::master::V_TopicInfo& topics);

/// A handle with the names of the only one under the node's namespace, where its images have no other names and nobody
/// publishes them; says in `problem` where there are several. Callbacks run where those of `nh` do.
std::optional<ros::NodeHandle> findOnlyStereoCamera(const ros::NodeHandle& nh, std::string& problem);

}  // namespace sdvo
