#include <gtest/gtest.h>

#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace sdvo::test_pose_graph {

constexpr double kPi = 3.14159265358979323846;

Matrix6d covariance(double translation, double rotation) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(translation * translation), Eigen::Vector3d::Constant(rotation * rotation);
  return variances.asDiagonal();
}

/// Node k of n on a circle, looking along it.
Eigen::Isometry3d onCircle(int k, int n, double radius) {
  const double angle = 2.0 * kPi * k / n;
  return Eigen::Translation3d(radius * Eigen::Vector3d(1.0 - std::cos(angle), 0.0, std::sin(angle))) *
         Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY());
}

/// A motion of which every number errs by so much.
Eigen::Isometry3d random(double translation, double rotation, std::mt19937& source) {
  std::normal_distribution<double> normal(0.0, 1.0);
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = (i < 3 ? translation : rotation) * normal(source);
  return expSE3(xi);
}

GraphEdge edge(int from, int to, GraphEdge::Kind kind, const Eigen::Isometry3d& T_from_to, const Matrix6d& covariance) {
  GraphEdge edge;
  edge.from = from;
  edge.to = to;
  edge.kind = kind;
  edge.T_from_to = T_from_to;
  edge.covariance = covariance;
  edge.length = kind == GraphEdge::Kind::kOdometry ? T_from_to.translation().norm() : 0.0;
  edge.turn = kind == GraphEdge::Kind::kOdometry ? Eigen::AngleAxisd(T_from_to.linear()).angle() : 0.0;
  return edge;
}

/// Truth and a chain once around a circle of 100 nodes and 20 more, each step of which turns too far.
struct Ring {
  static constexpr int kAround = 100, kNodes = 120;
  PoseGraph graph;
  std::vector<Eigen::Isometry3d> truth;

  explicit Ring(double turn_too_far = 0.001) {
    for (int k = 0; k < kNodes; ++k) truth.push_back(onCircle(k, kAround, 50.0));
    const Eigen::AngleAxisd drift(turn_too_far, Eigen::Vector3d::UnitY());
    graph.start(0, truth[0]);
    for (int k = 1; k < kNodes; ++k)
      graph.extend(edge(k - 1, k, GraphEdge::Kind::kOdometry, truth[k - 1].inverse() * truth[k] * drift,
                        covariance(0.003, 0.0002)));
  }

  GraphEdge loop(int from, int to) const {
    return edge(from, to, GraphEdge::Kind::kLoop, truth[from].inverse() * truth[to], covariance(0.02, 0.002));
  }

  double largestError() const {
    double largest = 0.0;
    for (int k = 0; k < kNodes; ++k)
      largest = std::max(largest, (graph.nodes().at(k).translation() - truth[k].translation()).norm());
    return largest;
  }
};

TEST(PoseGraph, ALoopTakesTheDriftBack) {
  Ring ring;
  const double before = ring.largestError();
  ASSERT_GT(before, 5.0);
  for (int k = 100; k < 110; ++k) ring.graph.close(ring.loop(k - 100, k));
  EXPECT_TRUE(ring.graph.optimise().converged);
  EXPECT_LT(ring.largestError(), 0.02 * before);
  const double measured = 2.0 * kPi / Ring::kAround + 0.001, is = 2.0 * kPi / Ring::kAround;
  EXPECT_NEAR(ring.graph.turnError(), is / measured - 1.0, 0.001) << "common to all turns";
  EXPECT_EQ(ring.graph.loops(), 10);
  EXPECT_TRUE(ring.graph.nodes().at(0).isApprox(ring.truth[0])) << "the first one stays";
}

TEST(PoseGraph, AGoodOdometryIsNotBentByInexactLoops) {
  Ring ring(0.0);
  std::mt19937 source(1);
  for (int k = 100; k < 120; ++k) {
    GraphEdge loop = ring.loop(k - 100, k);
    loop.T_from_to = loop.T_from_to * random(0.1, 0.005, source);
    loop.covariance = covariance(0.1, 0.005);
    ring.graph.close(loop);
  }
  ring.graph.optimise();
  EXPECT_LT(ring.largestError(), 0.08) << "each loop is off by 0.17 m";
}

TEST(PoseGraph, WithoutLoopsNothingMoves) {
  Ring ring;
  const auto before = ring.graph.nodes();
  EXPECT_TRUE(ring.graph.optimise().converged);
  for (const auto& [id, T] : before) EXPECT_TRUE(T.isApprox(ring.graph.nodes().at(id), 0.0));
}

TEST(PoseGraph, OneFalseLoopDoesNotBendTheMap) {
  for (const int right : {0, 10}) {  // loops beside it
    Ring ring, misled;
    for (Ring* each : {&ring, &misled})
      for (int k = 100; k < 100 + right; ++k) each->graph.close(each->loop(k - 100, k));
    GraphEdge wrong = misled.loop(20, 70);  // opposite sides of the circle, said to be one place
    wrong.T_from_to = Eigen::Isometry3d::Identity();
    misled.graph.close(wrong);
    ring.graph.optimise();
    misled.graph.optimise();
    for (const auto& [id, T] : ring.graph.nodes())
      EXPECT_LT((T.translation() - misled.graph.nodes().at(id).translation()).norm(), right > 0 ? 0.5 : 2.0) << id;
    EXPECT_GT(misled.graph.residual(wrong), 100.0);
  }
}

TEST(PoseGraph, APartBehindABreakMovesAsAWholeOnceAPlaceIsRecognised) {
  const auto truth = [](int k) { return onCircle(k, 100, 50.0); };
  PoseGraph graph;
  graph.start(0, truth(0));
  for (int k = 1; k < 100; ++k) {
    const bool broken = k == 60;
    Eigen::Isometry3d T = truth(k - 1).inverse() * truth(k);
    if (broken) T = onCircle(13, 31, 80.0);  // anything
    graph.extend(edge(k - 1, k, broken ? GraphEdge::Kind::kBreak : GraphEdge::Kind::kOdometry, T,
                      broken ? covariance(1000.0, 10.0) : covariance(0.01, 0.001)));
  }
  EXPECT_FALSE(graph.path(50, 70).known);
  EXPECT_TRUE(graph.path(50, 59).known);
  const Eigen::Isometry3d T_10_90 = truth(10).inverse() * truth(90);
  graph.close(edge(10, 90, GraphEdge::Kind::kLoop, T_10_90, covariance(0.02, 0.002)));
  for (int k = 0; k < 100; ++k) EXPECT_TRUE(graph.nodes().at(k).isApprox(truth(k), 1e-6)) << k;
  EXPECT_TRUE(graph.path(50, 70).known);
  EXPECT_TRUE(graph.optimise().converged);
  for (int k = 0; k < 100; ++k)
    EXPECT_LT((graph.nodes().at(k).translation() - truth(k).translation()).norm(), 0.2) << k;
}

/// A loaded map of two parts that no loop has joined, and a session that knows where it is in one of them.
TEST(PoseGraph, ALoopMovesNoHeldPart) {
  const auto step = [](int from, int to, GraphEdge::Kind kind) {
    return edge(from, to, kind, Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 1.0)), covariance(0.01, 0.001));
  };
  using Kind = GraphEdge::Kind;
  PoseGraph graph;
  graph.start(0, Eigen::Isometry3d::Identity());
  for (int k = 1; k < 8; ++k) graph.extend(step(k - 1, k, k % 3 == 0 ? Kind::kBreak : Kind::kOdometry));
  graph.hold(5);  // 0 to 2 and 3 to 5; 6 and 7 are of the session
  const auto before = graph.nodes();
  for (const int place : {1, 4, 1}) {
    graph.close(step(place, 7, Kind::kLoop));
    EXPECT_EQ(graph.loops(), 1) << "the newest recognition counts";
    EXPECT_NEAR(graph.nodes().at(7).translation().z(), before.at(place).translation().z() + 1.0, 1e-9);
    EXPECT_TRUE(graph.path(6, place).known);
    for (int k = 0; k < 6; ++k) EXPECT_EQ(graph.nodes().at(k).matrix(), before.at(k).matrix()) << k;
  }
}

TEST(PoseGraph, ALoopOutlivesItsNodeAsOneOfTheNextNode) {
  Ring ring;
  ring.graph.close(ring.loop(0, 100));
  const GraphPath before = ring.graph.path(0, 105);
  Eigen::Isometry3d T_0_103 = ring.loop(0, 100).T_from_to;
  for (int k = 100; k < 103; ++k) T_0_103 = T_0_103 * ring.graph.edges()[static_cast<std::size_t>(k)].T_from_to;
  for (int k = 100; k < 103; ++k) {
    ring.graph.passLoopsOn(k);
    ring.graph.remove(k);
  }
  ring.graph.remove(50);  // no other way
  const GraphPath after = ring.graph.path(0, 105);
  ASSERT_TRUE(after.known);
  EXPECT_EQ(ring.graph.loops(), 1);
  EXPECT_TRUE(ring.graph.edges().back().T_from_to.isApprox(T_0_103, 1e-9));
  EXPECT_NEAR(after.length, before.length, 1e-9);
  EXPECT_NEAR(after.turn, before.turn, 1e-9);
  EXPECT_TRUE(after.covariance.isApprox(before.covariance, 1e-9));
  ring.graph.close(ring.loop(3, 104));
  ring.graph.passLoopsOn(103);
  ring.graph.remove(103);
  EXPECT_EQ(ring.graph.loops(), 1) << "the next node has a loop of its own";
}

TEST(PoseGraph, AnOptimisedCopyIsAdoptedByWhatHasGrownMeanwhile) {
  Ring ring;
  for (int k = 100; k < 110; ++k) ring.graph.close(ring.loop(k - 100, k));
  PoseGraph copy = ring.graph;
  const Eigen::Isometry3d step = onCircle(1, 100, 50.0);
  ring.graph.extend(edge(Ring::kNodes - 1, Ring::kNodes, GraphEdge::Kind::kOdometry, step, covariance(0.01, 0.001)));
  copy.optimise();
  ASSERT_TRUE(ring.graph.adopt(copy));
  for (const auto& [id, T] : copy.nodes()) EXPECT_TRUE(T.isApprox(ring.graph.nodes().at(id), 0.0)) << id;
  const Eigen::Isometry3d last = copy.nodes().at(Ring::kNodes - 1) * step;
  EXPECT_TRUE(ring.graph.nodes().at(Ring::kNodes).isApprox(last, 1e-9)) << "the new one follows its neighbour";
}

TEST(PoseGraph, ACopyFromBeforeAPartMovedIsRefused) {
  PoseGraph graph;
  graph.start(0, Eigen::Isometry3d::Identity());
  graph.extend(edge(0, 1, GraphEdge::Kind::kBreak, Eigen::Isometry3d::Identity(), covariance(1000.0, 10.0)));
  const PoseGraph copy = graph;
  graph.close(edge(0, 1, GraphEdge::Kind::kLoop, onCircle(3, 10, 5.0), covariance(0.01, 0.01)));
  EXPECT_FALSE(graph.adopt(copy));
  EXPECT_TRUE(graph.nodes().at(1).isApprox(onCircle(3, 10, 5.0), 1e-9));
}

TEST(PoseGraph, APathIsTheShortestAndItsCovarianceThatOfTheWholeMotion) {
  Ring ring;
  const GraphPath way = ring.graph.path(0, 110);
  ASSERT_TRUE(way.known);
  EXPECT_NEAR(way.length, 110 * ring.graph.edges().front().length, 1e-6);
  const GraphPath back = ring.graph.path(110, 0);
  EXPECT_NEAR(back.length, way.length, 1e-9);
  ring.graph.close(ring.loop(0, 100));
  EXPECT_NEAR(ring.graph.path(0, 110).length, 10 * ring.graph.edges().front().length, 1e-6);

  // Against samples of the edges' errors.
  PoseGraph chain;
  chain.start(0, Eigen::Isometry3d::Identity());
  std::vector<GraphEdge> edges;
  for (int k = 0; k < 5; ++k) {
    edges.push_back(edge(k, k + 1, GraphEdge::Kind::kOdometry, onCircle(1, 12, 10.0), covariance(0.02, 0.003)));
    chain.extend(edges.back());
  }
  std::mt19937 source(1);
  const Eigen::Isometry3d T_5_0 = chain.nodes().at(5).inverse();
  for (const bool forward : {true, false}) {
    Matrix6d sampled = Matrix6d::Zero();
    constexpr int kSamples = 4000;
    for (int s = 0; s < kSamples; ++s) {
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      for (const GraphEdge& each : edges) T = T * each.T_from_to * random(0.02, 0.003, source);
      const Vector6d error = forward ? logSE3(T_5_0 * T) : logSE3(T_5_0.inverse() * T.inverse());
      sampled += error * error.transpose() / kSamples;
    }
    const Matrix6d told = forward ? chain.path(0, 5).covariance : chain.path(5, 0).covariance;
    EXPECT_LT((sampled - told).norm(), 0.08 * told.norm()) << (forward ? "forward" : "back");
  }
}

TEST(PoseGraph, NearAreTheNodesOnAShortWayOverLoopsAndNotOverBreaks) {
  Ring ring;
  const double step = ring.graph.edges().front().length;
  EXPECT_EQ(ring.graph.near(5, 2.5 * step), (std::set<int>{3, 4, 5, 6, 7}));
  EXPECT_EQ(ring.graph.near(5, 0.0), std::set<int>{5});
  ring.graph.close(ring.loop(5, 105));
  EXPECT_EQ(ring.graph.near(5, 1.5 * step), (std::set<int>{4, 5, 6, 104, 105, 106}));

  PoseGraph broken;
  broken.start(0, Eigen::Isometry3d::Identity());
  broken.extend(edge(0, 1, GraphEdge::Kind::kBreak, onCircle(1, 12, 10.0), covariance(0.02, 0.003)));
  EXPECT_EQ(broken.near(0, 1e6), std::set<int>{0});
}

TEST(PoseGraph, ForgettingTheFirstNodeLeavesTheRestWhereItIs) {
  Ring ring;
  ring.graph.close(ring.loop(0, 100));
  ring.graph.close(ring.loop(5, 105));
  const Eigen::Isometry3d second = ring.graph.nodes().at(1);
  ring.graph.remove(0);
  EXPECT_EQ(ring.graph.nodes().count(0), 0u);
  EXPECT_EQ(ring.graph.loops(), 1);
  EXPECT_TRUE(ring.graph.optimise().converged);
  EXPECT_TRUE(ring.graph.nodes().at(1).isApprox(second, 1e-12));
}

TEST(PoseGraph, IsMadeOfItsPartsAgainAndRefusesPartsThatDoNotFit) {
  Ring ring;
  ring.graph.close(ring.loop(0, 100));
  PoseGraph again(ring.graph.nodes(), ring.graph.edges());
  ring.graph.optimise();
  again.optimise();
  for (const auto& [id, T] : ring.graph.nodes()) EXPECT_TRUE(T.isApprox(again.nodes().at(id), 1e-12));

  std::vector<GraphEdge> edges{ring.loop(0, 100)};
  expectError([&] { PoseGraph({}, edges); }, {"edge 0 - 100"});
  edges[0].covariance(2, 2) = -1.0;
  expectError([&] { PoseGraph(ring.graph.nodes(), edges); }, {"covariance"});
}

}  // namespace sdvo::test_pose_graph
