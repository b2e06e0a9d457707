#include <gtest/gtest.h>
#include <ros/serialization.h>

#include "../../src/messages/place_conversions.hpp"
#include "../../src/messages/pose_conversions.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "message_samples.hpp"

namespace sdvo::ros_conversions::test_place_messages {

namespace msgs = stereo_descriptor_vo;

Eigen::Isometry3d somePose(double x) {
  return Eigen::Translation3d(x, -2.5, 0.25) * Eigen::AngleAxisd(0.3 * x, Eigen::Vector3d(0.36, 0.48, 0.8));
}

/// Full, and another one for each number given.
Matrix6d someCovariance(double scale) {
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = (i % 7 == 0 ? 3.0 : 0.1 * (i % 5)) * scale;
  return root * root.transpose();
}

Place somePlace(int id = 7) {
  Place place;
  place.id = id;
  place.segment = 2;
  place.travelled = 123.5;
  place.T_odom_camera = somePose(1.5);
  place.features = someFeatures();
  place.features.patches = cv::Mat();
  place.features.patch_layout = {};
  return place;
}

FeatureStream someStream() {
  FeatureStream stream;
  stream.frame_id = "left_optical";
  stream.size_curve.slope = 0.5;
  return stream;
}

MapState someMap() {
  std::map<int, Eigen::Isometry3d> nodes = {{3, somePose(0.0)}, {4, somePose(1.0)}, {6, somePose(2.0)}};
  std::vector<GraphEdge> edges(3);
  const GraphEdge::Kind kinds[] = {GraphEdge::Kind::kOdometry, GraphEdge::Kind::kBreak, GraphEdge::Kind::kLoop};
  const int ends[][2] = {{3, 4}, {4, 6}, {3, 6}};
  for (int i = 0; i < 3; ++i) {
    edges[i].kind = kinds[i];
    edges[i].from = ends[i][0];
    edges[i].to = ends[i][1];
    edges[i].T_from_to = somePose(0.5 + i);
    edges[i].covariance = someCovariance(0.1 * (i + 1));
    edges[i].length = 2.0 - i;
  }
  edges[2].length = 0.0;
  return {PoseGraph(nodes, edges), {{3, 1000000000}, {4, 2000000001}, {6, 3000000002}}};
}

/// As it arrives.
template <class Message>
Message sent(const Message& message) {
  ros::SerializedMessage bytes = ros::serialization::serializeMessage(message);
  Message received;
  ros::serialization::deserializeMessage(bytes, received);
  return received;
}

TEST(PlaceMessage, HoldsAllOfAPlace) {
  const Place place = somePlace();
  const msgs::Place message = sent(toMessage(place, "/robot", someStream()));
  EXPECT_EQ(message.robot, "/robot");
  EXPECT_EQ(message.features.header.frame_id, "left_optical");
  EXPECT_EQ(message.features.size_slope, 0.5f);
  EXPECT_TRUE(message.features.patches.empty());
  EXPECT_EQ(streamOf(message.features).size_curve.slope, 0.5);
  const Place again = fromMessage(message);
  EXPECT_EQ(again.id, place.id);
  EXPECT_EQ(again.segment, place.segment);
  EXPECT_EQ(again.travelled, place.travelled);
  EXPECT_TRUE(again.T_odom_camera.isApprox(place.T_odom_camera, 1e-12));
  EXPECT_EQ(again.features.stamp, place.features.stamp);
  EXPECT_EQ(again.features.camera, place.features.camera);
  EXPECT_EQ(again.features.kind(), place.features.kind());
  synthetic::expectEqual(again.features, place.features);
}

TEST(PlaceMessage, IsRefusedWhenItDoesNotHoldTogether) {
  using M = msgs::Place;
  expectRefusals(toMessage(somePlace(), "/robot", someStream()), [](const M& message) { fromMessage(message); },
                 {{[](M& m) { m.id = 0xffffffffu; }, "id 4294967295 is too large"},
                  {[](M& m) { m.segment = 0x7fffffffu; }, "segment 2147483647 is too large"},
                  {[](M& m) { m.travelled = kNaN; }, "travelled is not finite"},
                  {[](M& m) { m.pose.position.y = kInfinity; }, "the position is not finite"},
                  {[](M& m) { m.pose.orientation.w += 0.1; },
                   "the quaternion has not unit length: normalise it (w = 1 and the rest 0: no rotation)"},
                  {[](M& m) { m.features.header.stamp = ros::Time(); }, "zero stamp"},
                  {[](M& m) { m.features.v.pop_back(); }, "refused: array v has 4 elements"}});
}

TEST(MapGraphMessage, HoldsAllOfAGraph) {
  const MapState map = someMap();
  const msgs::MapGraph message = sent(toMessage(map, "/robot", "map"));
  EXPECT_EQ(message.header.frame_id, "map");
  EXPECT_EQ(message.header.stamp, ros::Time(3, 2));
  ASSERT_EQ(message.nodes.size(), 3u);
  EXPECT_EQ(message.nodes[1].stamp, ros::Time(2, 1));
  ASSERT_EQ(message.edges.size(), 3u);
  EXPECT_EQ(message.edges[0].kind, "odometry");
  EXPECT_EQ(message.edges[1].kind, "break");
  EXPECT_EQ(message.edges[2].kind, "loop");
  const PoseGraph again = fromMessage(message);
  ASSERT_EQ(again.nodes().size(), 3u);
  for (const auto& [id, T] : map.graph.nodes()) EXPECT_TRUE(again.nodes().at(id).isApprox(T, 1e-12)) << id;
  ASSERT_EQ(again.edges().size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const GraphEdge &was = map.graph.edges()[i], &is = again.edges()[i];
    EXPECT_EQ(is.kind, was.kind);
    EXPECT_EQ(is.from, was.from);
    EXPECT_EQ(is.to, was.to);
    EXPECT_EQ(is.length, was.length);
    EXPECT_TRUE(is.T_from_to.isApprox(was.T_from_to, 1e-12));
    EXPECT_TRUE(is.covariance.isApprox(was.covariance, 1e-12));
  }
}

TEST(MapGraphMessage, CovariancesAreInTheParentsAxes) {
  GraphEdge edge;
  edge.to = 1;
  // The child's x axis is the parent's y axis, its y axis the parent's z axis.
  edge.T_from_to.linear() << 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
  edge.covariance.diagonal() << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0;
  const PoseGraph graph({{0, Eigen::Isometry3d::Identity()}, {1, edge.T_from_to}}, {edge});
  const msgs::MapGraph message = toMessage(MapState{graph, {}}, "", "map");
  const auto& covariance = message.edges[0].motion.covariance;
  const double expected[] = {3.0, 1.0, 2.0, 6.0, 4.0, 5.0};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(covariance[7 * i], expected[i], 1e-12) << i;
}

TEST(MapGraphMessage, IsRefusedWhenItDoesNotHoldTogether) {
  using M = msgs::MapGraph;
  expectRefusals(toMessage(someMap(), "/robot", "map"), [](const M& message) { fromMessage(message); },
                 {{[](M& m) { m.nodes[1].id = m.nodes[0].id; }, ""},
                  {[](M& m) { m.nodes[1].pose.orientation.x = kNaN; }, ""},
                  {[](M& m) { m.nodes.pop_back(); }, ""},
                  {[](M& m) { m.edges[0].kind = "guess"; }, ""},
                  {[](M& m) { m.edges[0].length = -1.0; }, ""},
                  {[](M& m) { m.edges[0].motion.covariance[0] = -1.0; }, ""},
                  {[](M& m) { m.edges[0].motion.covariance[35] = kNaN; }, ""}});
}

TEST(PlaceSignatureMessage, ComesBackWhereWordsAreMadeAlike) {
  const Place place = somePlace();
  const PlaceSignature words = {5, 17, 1u << 18};
  const msgs::PlaceSignature message = sent(toMessage(words, place, "/robot", "left_optical"));
  EXPECT_EQ(message.id, 7u);
  EXPECT_EQ(message.header.stamp.toNSec(), static_cast<std::uint64_t>(place.features.stamp));
  EXPECT_EQ(fromMessage(message, place.features.kind()), words);

  using M = msgs::PlaceSignature;
  expectRefusals(message, [&](const M& m) { fromMessage(m, place.features.kind()); },
                 {{[](M& m) { ++m.words_per_row; }, ""},
                  {[](M& m) { ++m.bits_per_word; }, ""},
                  {[](M& m) { m.descriptor = "orb"; }, ""},
                  {[](M& m) { m.layout = "left"; }, ""},
                  {[](M& m) { m.bytes_per_row = 64; }, ""},
                  {[](M& m) {
                     m.words = {17, 5};
                   },
                   ""},
                  {[](M& m) {
                     m.words = {5, 5};
                   },
                   ""},
                  {[](M& m) { m.words = {0xffffffffu}; }, ""},
                  {[](M& m) { m.words.resize(1u << 20); }, ""}});
}

TEST(MapPath, HoldsPosesOfTheBase) {
  const MapState map = someMap();
  const Eigen::Isometry3d T_base_camera = somePose(-1.0);
  const nav_msgs::Path path = toPath(map, T_base_camera, "map");
  ASSERT_EQ(path.poses.size(), 3u);
  EXPECT_EQ(path.poses[0].header.stamp, ros::Time(1));
  EXPECT_TRUE((toPose(path.poses[2].pose) * T_base_camera).isApprox(map.graph.nodes().at(6), 1e-12));
}

TEST(MapMarkers, HaveALineForEachEdge) {
  const visualization_msgs::MarkerArray array = toMarkers(someMap(), "map");
  ASSERT_EQ(array.markers.size(), 3u);
  for (const visualization_msgs::Marker& marker : array.markers) {
    EXPECT_EQ(marker.points.size(), 2u) << marker.ns;
    EXPECT_EQ(marker.header.frame_id, "map");
    EXPECT_EQ(marker.action, visualization_msgs::Marker::ADD);
  }
  EXPECT_EQ(array.markers[1].ns, "loop");
  EXPECT_EQ(array.markers[1].points[1].x, 2.0);
}

TEST(PlaceInfo, TellsTheReport) {
  PlaceReport report;
  report.id = 9;
  report.candidates = {{4, 0.5}, {5, 0.25}};
  report.reason = "why";
  report.match.matches = 100;
  report.match.inliers = 60;
  report.match.coverage = 0.5;
  report.match.rms = 0.75;
  report.find_time = 0.125;
  report.verify_time = 0.0625;
  msgs::PlaceInfo info = toInfo(report);
  EXPECT_EQ(info.id, 9u);
  EXPECT_EQ(info.candidates, (std::vector<std::uint32_t>{4, 5}));
  EXPECT_EQ(info.scores, (std::vector<float>{0.5f, 0.25f}));
  EXPECT_EQ(info.same, -1);
  EXPECT_FALSE(info.loop);
  EXPECT_EQ(info.reason, "why");
  EXPECT_EQ(info.matches, 100u);
  EXPECT_EQ(info.inliers, 60u);
  EXPECT_EQ(info.coverage, 0.5f);
  EXPECT_EQ(info.rms_reprojection_error, 0.75f);
  EXPECT_EQ(info.find_time, 0.125f);
  EXPECT_EQ(info.verify_time, 0.0625f);
  report.same = 4;
  report.loop = true;
  info = toInfo(report);
  EXPECT_EQ(info.same, 4);
  EXPECT_TRUE(info.loop);
}

TEST(MotionCovariance, IsThatOfTheCamera) {
  OdometryResult result = trackedResult();
  result.motion_covariance = someCovariance(0.01);
  const Eigen::Isometry3d T_base_camera = somePose(0.75);
  for (const double dt : {0.1, 1.5}) {
    result.dt = dt;
    const nav_msgs::Odometry odometry = toOdometry(result, T_base_camera, {});
    const Matrix6d covariance = toMotionCovariance(odometry, dt, T_base_camera);
    EXPECT_LT((covariance - result.motion_covariance).cwiseAbs().maxCoeff(), 1e-7) << dt;
  }
}

}  // namespace sdvo::ros_conversions::test_place_messages
