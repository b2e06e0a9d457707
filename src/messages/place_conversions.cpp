#include "place_conversions.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../common/text.hpp"
#include "feature_conversions.hpp"
#include "frames.hpp"
#include "pose_conversions.hpp"
#include "stamps.hpp"

namespace sdvo {

static const std::vector<std::string>& namesOf(GraphEdge::Kind) {
  using Edge = stereo_descriptor_vo::MapEdge;
  static const std::vector<std::string> names = {Edge::ODOMETRY, Edge::LOOP, Edge::BREAK};
  return names;
}

namespace ros_conversions {
namespace msgs = stereo_descriptor_vo;
namespace {

/// Stamp in ns.
ros::Time toTime(std::int64_t stamp) {
  return ros::Time().fromNSec(static_cast<std::uint64_t>(stamp));
}

std_msgs::Header headerOf(std::int64_t stamp, const std::string& frame_id) {
  std_msgs::Header header;
  header.stamp = toTime(stamp);
  header.frame_id = frame_id;
  return header;
}

/// Throws std::invalid_argument that gives `name` when the number is too large.
int toInt(std::uint32_t number, const char* name) {
  if (number >= static_cast<std::uint32_t>(std::numeric_limits<int>::max()))
    throw std::invalid_argument(text(0, name, " ", number, " is too large"));
  return static_cast<int>(number);
}

}  // namespace

FeatureStream streamOf(const msgs::StereoFeatures& message) {
  FeatureStream stream;
  stream.frame_id = cleanFrameId(message.header.frame_id);
  DepthScaleOptions& curve = stream.size_curve;
  curve.scale_normalisation = message.scale_normalised;
  curve.slope = message.size_slope;
  curve.exponent = message.size_exponent;
  curve.offset = message.size_offset;
  if (message.scale_normalised)
    curve.min_size = message.size_min, curve.max_size = message.size_max;
  else
    curve.constant_size = message.size_min;
  return stream;
}

msgs::Place toMessage(const Place& place, const std::string& robot, const FeatureStream& stream) {
  msgs::Place message;
  message.robot = robot;
  message.id = static_cast<std::uint32_t>(place.id);
  message.pose = tf2::toMsg(place.T_odom_camera);
  message.segment = static_cast<std::uint32_t>(place.segment);
  message.travelled = place.travelled;
  message.features = toMessage(place.features, stream.size_curve);
  message.features.header = headerOf(place.features.stamp, stream.frame_id);
  return message;
}

Place fromMessage(const msgs::Place& message) {
  Place place;
  place.id = toInt(message.id, "id");
  place.T_odom_camera = toPose(message.pose);
  place.segment = toInt(message.segment, "segment");
  if (!std::isfinite(message.travelled)) throw std::invalid_argument("travelled is not finite");
  place.travelled = message.travelled;
  const std::string problem = whyUnusable(message.features.header.stamp);
  if (!problem.empty()) throw std::invalid_argument(problem);
  place.features = fromMessage(message.features);
  return place;
}

msgs::PlaceInfo toInfo(const PlaceReport& report) {
  msgs::PlaceInfo info;
  info.id = static_cast<std::uint32_t>(report.id);
  for (const PlaceCandidate& candidate : report.candidates) {
    info.candidates.push_back(static_cast<std::uint32_t>(candidate.place));
    info.scores.push_back(static_cast<float>(candidate.score));
  }
  info.same = report.same ? *report.same : -1;
  info.loop = report.loop;
  info.reason = report.reason;
  info.matches = static_cast<std::uint32_t>(report.match.matches);
  info.inliers = static_cast<std::uint32_t>(report.match.inliers);
  info.coverage = static_cast<float>(report.match.coverage);
  info.rms_reprojection_error = static_cast<float>(report.match.rms);
  info.find_time = static_cast<float>(report.find_time);
  info.verify_time = static_cast<float>(report.verify_time);
  return info;
}

msgs::PlaceSignature toMessage(const PlaceSignature& words, const Place& place, const std::string& robot,
                               const std::string& frame_id) {
  msgs::PlaceSignature message;
  message.header = headerOf(place.features.stamp, frame_id);
  message.robot = robot;
  message.id = static_cast<std::uint32_t>(place.id);
  const DescriptorKind kind = place.features.kind();
  message.descriptor = kind.descriptor;
  message.layout = nameOf(kind.layout);
  message.element_type = nameOf(kind.element_type);
  message.bytes_per_row = static_cast<std::uint32_t>(kind.bytes);
  message.words_per_row = PlaceIndex::kWordsPerRow;
  message.bits_per_word = PlaceIndex::kBitsPerWord;
  message.words = words;
  return message;
}

PlaceSignature fromMessage(const msgs::PlaceSignature& message, const DescriptorKind& kind) {
  const auto refuse = [](const std::string& what) {
    throw std::invalid_argument("PlaceSignature message refused: " + what);
  };
  if (message.words_per_row != PlaceIndex::kWordsPerRow || message.bits_per_word != PlaceIndex::kBitsPerWord)
    refuse(text(0, message.words_per_row, " words of ", message.bits_per_word, " bits for a row, here ",
                PlaceIndex::kWordsPerRow, " of ", PlaceIndex::kBitsPerWord, ": other versions of this package?"));
  if (message.descriptor != kind.descriptor || message.layout != nameOf(kind.layout) ||
      message.element_type != nameOf(kind.element_type) ||
      message.bytes_per_row != static_cast<std::uint32_t>(kind.bytes))
    refuse(text(0, "descriptors ", message.descriptor, ", ", message.layout, ", ", message.bytes_per_row,
                " bytes, here ", toString(kind), ": set descriptor/... alike in both robots"));
  constexpr std::size_t kMostWords = 1u << 18;
  if (message.words.size() > kMostWords) refuse(std::to_string(message.words.size()) + " words");
  if (std::adjacent_find(message.words.begin(), message.words.end(), std::greater_equal<>()) != message.words.end())
    refuse("words that do not ascend");
  const std::uint64_t end = std::uint64_t{PlaceIndex::kWordsPerRow} << PlaceIndex::kBitsPerWord;
  if (!message.words.empty() && message.words.back() >= end) refuse("a word beyond the largest one");
  return message.words;
}

msgs::PlaceMatch toMessage(const PlaceMatch& match, const Place& mine, const Place& other,
                           const std::string& frame_id) {
  msgs::PlaceMatch message;
  message.header = headerOf(mine.features.stamp, frame_id);
  message.id = static_cast<std::uint32_t>(mine.id);
  message.other_id = static_cast<std::uint32_t>(other.id);
  message.other_stamp = toTime(other.features.stamp);
  message.pose = toMessage(match.T_place_camera, match.covariance);
  message.matches = static_cast<std::uint32_t>(match.matches);
  message.inliers = static_cast<std::uint32_t>(match.inliers);
  message.coverage = static_cast<float>(match.coverage);
  message.rms_reprojection_error = static_cast<float>(match.rms);
  return message;
}

namespace {

msgs::MapEdge edgeMessage(const GraphEdge& edge) {
  msgs::MapEdge message;
  message.kind = nameOf(edge.kind);
  message.from_id = static_cast<std::uint32_t>(edge.from);
  message.to_id = static_cast<std::uint32_t>(edge.to);
  message.motion = toMessage(edge.T_from_to, edge.covariance);
  message.length = edge.length;
  message.turn = edge.turn;
  return message;
}

GraphEdge edgeOf(const msgs::MapEdge& message) {
  GraphEdge edge;
  edge.kind = valueOf<GraphEdge::Kind>(message.kind);
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

/// With the stamp of the newest key frame.
std_msgs::Header headerOf(const MapState& map, const std::string& frame_id) {
  return headerOf(map.stamps.empty() ? 0 : map.stamps.rbegin()->second, frame_id);
}

std::int64_t stampOf(const MapState& map, int id) {
  const auto found = map.stamps.find(id);
  return found == map.stamps.end() ? 0 : found->second;
}

}  // namespace

msgs::MapGraph toMessage(const MapState& map, const std::string& robot, const std::string& frame_id) {
  msgs::MapGraph message;
  message.header = headerOf(map, frame_id);
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

PoseGraph fromMessage(const msgs::MapGraph& message) {
  std::map<int, Eigen::Isometry3d> nodes;
  for (const msgs::MapNode& node : message.nodes)
    if (!nodes.emplace(toInt(node.id, "id"), toPose(node.pose)).second)
      throw std::invalid_argument("node " + std::to_string(node.id) + " is there twice");
  std::vector<GraphEdge> edges;
  for (const msgs::MapEdge& edge : message.edges) edges.push_back(edgeOf(edge));
  return PoseGraph(std::move(nodes), std::move(edges));
}

nav_msgs::Path toPath(const MapState& map, const Eigen::Isometry3d& T_base_camera, const std::string& frame_id) {
  nav_msgs::Path path;
  path.header = headerOf(map, frame_id);
  const Eigen::Isometry3d T_camera_base = T_base_camera.inverse();
  for (const auto& [id, T_map_camera] : map.graph.nodes()) {
    geometry_msgs::PoseStamped pose;
    pose.header = headerOf(stampOf(map, id), frame_id);
    pose.pose = tf2::toMsg(Eigen::Isometry3d(T_map_camera * T_camera_base));
    path.poses.push_back(pose);
  }
  return path;
}

visualization_msgs::MarkerArray toMarkers(const MapState& map, const std::string& frame_id) {
  visualization_msgs::MarkerArray array;
  array.markers = {lines("odometry", 0, 0.16f, 0.47f, 1.f, 0.1), lines("loop", 1, 1.f, 0.4f, 0.f, 0.25),
                   lines("break", 2, 0.6f, 0.6f, 0.6f, 0.1)};
  for (visualization_msgs::Marker& marker : array.markers) marker.header = headerOf(map, frame_id);
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

}  // namespace ros_conversions
}  // namespace sdvo
