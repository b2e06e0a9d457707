#pragma once

#include <nav_msgs/Path.h>
#include <stereo_descriptor_vo/MapGraph.h>
#include <stereo_descriptor_vo/Place.h>
#include <stereo_descriptor_vo/PlaceInfo.h>
#include <stereo_descriptor_vo/PlaceMatch.h>
#include <stereo_descriptor_vo/PlaceSignature.h>
#include <stereo_descriptor_vo/StereoFeatures.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <string>

#include "../front_end/depth_scale.hpp"
#include "../places/place_index.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"
#include "stereo_descriptor_vo/places/pose_graph.hpp"

/// Where messages and the types of places meet.
namespace sdvo::ros_conversions {

/// Fields of feature messages that StereoFeatures does not have.
struct FeatureStream {
  std::string frame_id;  ///< of the camera
  DepthScaleOptions size_curve;
};
FeatureStream streamOf(const stereo_descriptor_vo::StereoFeatures& message);

stereo_descriptor_vo::Place toMessage(const Place& place, const std::string& robot, const FeatureStream& stream);
/// Throws std::invalid_argument if the message is inconsistent; the result owns its memory.
Place fromMessage(const stereo_descriptor_vo::Place& message);

/// From the report; the caller fills in header and counts.
stereo_descriptor_vo::PlaceInfo toInfo(const PlaceReport& report);

stereo_descriptor_vo::PlaceSignature toMessage(const PlaceSignature& words, const Place& place,
                                               const std::string& robot, const std::string& frame_id);
/// Throws std::invalid_argument if the words were not made by PlaceIndex from descriptors of this kind.
PlaceSignature fromMessage(const stereo_descriptor_vo::PlaceSignature& message, const DescriptorKind& kind);

/// The caller fills in the robots' names.
stereo_descriptor_vo::PlaceMatch toMessage(const PlaceMatch& match, const Place& mine, const Place& other,
                                           const std::string& frame_id);

/// Stamps of key frames by id, ns.
using PlaceStamps = std::map<int, std::int64_t>;

/// A map at one moment.
struct MapState {
  PoseGraph graph;
  PlaceStamps stamps;
};

stereo_descriptor_vo::MapGraph toMessage(const MapState& map, const std::string& robot, const std::string& frame_id);
/// Throws std::invalid_argument if the message is inconsistent.
PoseGraph fromMessage(const stereo_descriptor_vo::MapGraph& message);

/// Poses of the base at the key frames.
nav_msgs::Path toPath(const MapState& map, const Eigen::Isometry3d& T_base_camera, const std::string& frame_id);

/// The graph's edges as lines between the cameras, a marker for each kind.
visualization_msgs::MarkerArray toMarkers(const MapState& map, const std::string& frame_id);

}  // namespace sdvo::ros_conversions
