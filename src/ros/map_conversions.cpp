#include "map_conversions.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "message_numbers.hpp"
#include "pose_conversions.hpp"

namespace sdvo::ros_conversions {
namespace {

namespace msgs = stereo_descriptor_vo;

const std::vector<std::pair<GraphEdge::Kind, std::string>>& kindsOfEdges() {
  static const std::vector<std::pair<GraphEdge::Kind, std::string>> kinds = {
      {GraphEdge::Kind::kOdometry, msgs::MapEdge::ODOMETRY},
      {GraphEdge::Kind::kLoop, msgs::MapEdge::LOOP},
      {GraphEdge::Kind::kBreak, msgs::MapEdge::BREAK}};
  return kinds;
}

std::string nameOfKind(GraphEdge::Kind kind) {
  for (const auto& [value, name] : kindsOfEdges())
    if (value == kind) return name;
  throw std::logic_error("an edge of no known kind");
}

GraphEdge::Kind kindOfName(const std::string& text) {
  for (const auto& [value, name] : kindsOfEdges())
    if (name == text) return value;
  throw std::invalid_argument("unknown kind of edge '" + text + "'");
}

msgs::MapEdge edgeMessage(const GraphEdge& edge) {
  msgs::MapEdge message;
  message.kind = nameOfKind(edge.kind);
  message.from_id = static_cast<std::uint32_t>(edge.from);
  message.to_id = static_cast<std::uint32_t>(edge.to);
  message.motion = toMessage(edge.T_from_to, edge.covariance);
  message.length = edge.length;
  message.turn = edge.turn;
  return message;
}

GraphEdge edgeOf(const msgs::MapEdge& message) {
  GraphEdge edge;
  edge.kind = kindOfName(message.kind);
  edge.from = toInt(message.from_id, "id");
  edge.to = toInt(message.to_id, "id");
  fromMessage(message.motion, edge.T_from_to, edge.covariance);
  if (!(std::isfinite(message.length) && message.length >= 0.0 && std::isfinite(message.turn) && message.turn >= 0.0))
    throw std::invalid_argument("the length or the turn of an edge is not a number or negative");
  edge.length = message.length;
  edge.turn = message.turn;
  return edge;
}

visualization_msgs::Marker lines(const std::string& name, int id, float red, float green, float blue, double width) {
  visualization_msgs::Marker marker;
  marker.ns = name;
  marker.id = id;
  marker.type = visualization_msgs::Marker::LINE_LIST;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = width;
  marker.color.r = red;
  marker.color.g = green;
  marker.color.b = blue;
  marker.color.a = 1.f;
  return marker;
}

/// Newest stamp of the map's key frames.
ros::Time newestStamp(const MapState& map) {
  return map.stamps.empty() ? ros::Time() : toTime(map.stamps.rbegin()->second);
}

std::int64_t stampOf(const MapState& map, int id) {
  const auto found = map.stamps.find(id);
  return found == map.stamps.end() ? 0 : found->second;
}

}  // namespace

msgs::MapGraph toMessage(const MapState& map, const std::string& robot, const std::string& frame_id) {
  msgs::MapGraph message;
  message.header.stamp = newestStamp(map);
  message.header.frame_id = frame_id;
  message.robot = robot;
  for (const auto& [id, T_map_camera] : map.graph.nodes()) {
    msgs::MapNode node;
    node.id = static_cast<std::uint32_t>(id);
    node.stamp = toTime(stampOf(map, id));
    node.pose = tf2::toMsg(T_map_camera);
    message.nodes.push_back(node);
  }
  for (const GraphEdge& edge : map.graph.edges()) message.edges.push_back(edgeMessage(edge));
  return message;
}

PoseGraph fromMessage(const msgs::MapGraph& message, const PoseGraphOptions& options) {
  std::map<int, Eigen::Isometry3d> nodes;
  for (const msgs::MapNode& node : message.nodes)
    if (!nodes.emplace(toInt(node.id, "id"), toPose(node.pose)).second)
      throw std::invalid_argument("node " + std::to_string(node.id) + " is there twice");
  std::vector<GraphEdge> edges;
  for (const msgs::MapEdge& edge : message.edges) edges.push_back(edgeOf(edge));
  return PoseGraph(options, std::move(nodes), std::move(edges));
}

nav_msgs::Path toPath(const MapState& map, const Eigen::Isometry3d& T_base_camera, const std::string& frame_id) {
  nav_msgs::Path path;
  path.header.stamp = newestStamp(map);
  path.header.frame_id = frame_id;
  const Eigen::Isometry3d T_camera_base = T_base_camera.inverse();
  for (const auto& [id, T_map_camera] : map.graph.nodes()) {
    geometry_msgs::PoseStamped pose;
    pose.header.stamp = toTime(stampOf(map, id));
    pose.header.frame_id = frame_id;
    pose.pose = tf2::toMsg(Eigen::Isometry3d(T_map_camera * T_camera_base));
    path.poses.push_back(pose);
  }
  return path;
}

visualization_msgs::MarkerArray toMarkers(const MapState& map, const std::string& frame_id) {
  visualization_msgs::MarkerArray array;
  array.markers = {lines("odometry", 0, 0.16f, 0.47f, 1.f, 0.1), lines("loop", 1, 1.f, 0.4f, 0.f, 0.25),
                   lines("break", 2, 0.6f, 0.6f, 0.6f, 0.1)};
  for (visualization_msgs::Marker& marker : array.markers) {
    marker.header.stamp = newestStamp(map);
    marker.header.frame_id = frame_id;
  }
  const std::map<int, Eigen::Isometry3d>& nodes = map.graph.nodes();
  for (const GraphEdge& edge : map.graph.edges()) {
    std::vector<geometry_msgs::Point>& points = array.markers[static_cast<std::size_t>(edge.kind)].points;
    for (const int id : {edge.from, edge.to}) {
      const Eigen::Vector3d position = nodes.at(id).translation();
      points.push_back(tf2::toMsg(position));
    }
  }
  // rviz takes a list of lines without points for an error.
  for (visualization_msgs::Marker& marker : array.markers)
    if (marker.points.empty()) marker.action = visualization_msgs::Marker::DELETE;
  return array;
}

}  // namespace sdvo::ros_conversions
