#pragma once

#include <nav_msgs/Path.h>
#include <stereo_descriptor_vo/MapGraph.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <string>

#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace sdvo::ros_conversions {

/// Stamps of key frames by id, ns.
using PlaceStamps = std::map<int, std::int64_t>;

/// A map at one moment.
struct MapState {
  PoseGraph graph;
  PlaceStamps stamps;
};

stereo_descriptor_vo::MapGraph toMessage(const MapState& map, const std::string& robot, const std::string& frame_id);
/// Throws std::invalid_argument when the message does not hold together.
PoseGraph fromMessage(const stereo_descriptor_vo::MapGraph& message, const PoseGraphOptions& options);

/// Poses of the base at the key frames.
nav_msgs::Path toPath(const MapState& map, const Eigen::Isometry3d& T_base_camera, const std::string& frame_id);

/// The graph's edges as lines between the cameras, a marker for each kind.
visualization_msgs::MarkerArray toMarkers(const MapState& map, const std::string& frame_id);

}  // namespace sdvo::ros_conversions
