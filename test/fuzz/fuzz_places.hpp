#pragma once

#include <map>

#include "../../src/ros/files/places_file.hpp"
#include "../synthetic_features.hpp"
#include "fuzz_message.hpp"

namespace sdvo::fuzz {

inline ros_conversions::FeatureStream someStream() {
  ros_conversions::FeatureStream stream;
  stream.frame_id = "left_optical";
  return stream;
}

/// Four places a metre apart, the last one of which is the first again: a loop.
inline SavedPlaces somePlaces() {
  static const SavedPlaces some = [] {
    SyntheticScene scene(1, 90, 40.0);
    std::vector<Place> places;
    std::map<int, Eigen::Isometry3d> nodes;
    std::vector<GraphEdge> edges;
    for (int id = 0; id < 4; ++id) {
      Place place;
      place.id = id;
      place.T_odom_camera = syntheticPose(id % 3);
      place.features = scene.view(place.T_odom_camera, (id + 1) * 1000000000ll);
      nodes[id] = place.T_odom_camera;
      places.push_back(place);
      if (id == 0) continue;
      GraphEdge edge;
      edge.from = id - 1;
      edge.to = id;
      edge.kind = id == 2 ? GraphEdge::Kind::kBreak : GraphEdge::Kind::kOdometry;
      edge.T_from_to = nodes[id - 1].inverse() * nodes[id];
      edge.length = 1.0;
      edges.push_back(edge);
    }
    GraphEdge loop;
    loop.from = 0;
    loop.to = 3;
    loop.kind = GraphEdge::Kind::kLoop;
    edges.push_back(loop);
    return SavedPlaces{places, PoseGraph(nodes, edges), someStream()};
  }();
  return some;
}

inline void damage(geometry_msgs::Pose& pose, FuzzBytes& bytes) {
  for (double* value : {&pose.position.x, &pose.position.y, &pose.position.z, &pose.orientation.x, &pose.orientation.y,
                        &pose.orientation.z, &pose.orientation.w})
    replace(*value, bytes);
}

inline void damage(stereo_descriptor_vo::Place& message, FuzzBytes& bytes) {
  replace(message.id, bytes), replace(message.segment, bytes), replace(message.travelled, bytes);
  replace(message.features.header.stamp.sec, bytes);
  damage(message.pose, bytes);
  sdvo::damage(message.features, bytes);
}

inline void damage(stereo_descriptor_vo::MapGraph& message, FuzzBytes& bytes) {
  if (bytes.flag()) message.nodes.resize(bytes.upTo(6));
  if (bytes.flag()) message.edges.resize(bytes.upTo(6));
  for (stereo_descriptor_vo::MapNode& node : message.nodes) {
    if (!bytes.flag()) continue;
    replace(node.id, bytes);
    damage(node.pose, bytes);
  }
  for (stereo_descriptor_vo::MapEdge& edge : message.edges) {
    if (!bytes.flag()) continue;
    replace(edge.kind, bytes), replace(edge.from_id, bytes), replace(edge.to_id, bytes);
    replace(edge.length, bytes), replace(edge.turn, bytes);
    damage(edge.motion.pose, bytes);
    damageElements(edge.motion.covariance, bytes);
  }
}

}  // namespace sdvo::fuzz
