#include <gtest/gtest.h>

#include "../../src/places/loop_agreement.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"

namespace sdvo::test_loop_agreement {

Eigen::Isometry3d ahead(double z, double x = 0.0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(x, 0.0, z);
  return T;
}

/// Nodes 0 … 60 along a way, 3 m apart.
PoseGraph way() {
  PoseGraph graph;
  graph.start(0, Eigen::Isometry3d::Identity());
  for (int k = 1; k <= 60; ++k) {
    GraphEdge edge;
    edge.from = k - 1;
    edge.to = k;
    edge.T_from_to = ahead(3.0);
    edge.length = 3.0;
    graph.extend(edge);
  }
  return graph;
}

GraphEdge proposal(int from, int to, const Eigen::Isometry3d& T_from_to) {
  GraphEdge loop;
  loop.from = from;
  loop.to = to;
  loop.kind = GraphEdge::Kind::kLoop;
  loop.T_from_to = T_from_to;
  return loop;
}

TEST(LoopAgreement, TwoNeighboursThatSayTheSameAreTrusted) {
  const PoseGraph graph = way();
  LoopAgreement agreement;
  EXPECT_TRUE(agreement.confirm(graph, proposal(10, 50, ahead(0.4))).empty());
  const auto trusted = agreement.confirm(graph, proposal(11, 51, ahead(0.5)));
  ASSERT_EQ(trusted.size(), 2u);
  EXPECT_EQ(trusted[0].to, 50);
  EXPECT_EQ(trusted[1].to, 51);
  ASSERT_EQ(agreement.confirm(graph, proposal(13, 52, ahead(-2.6))).size(), 1u) << "the others were given out already";
}

TEST(LoopAgreement, NeighboursThatDisagreeAreNot) {
  const PoseGraph graph = way();
  LoopAgreement agreement;
  agreement.confirm(graph, proposal(10, 50, ahead(0.0)));
  EXPECT_TRUE(agreement.confirm(graph, proposal(11, 51, ahead(0.7))).empty()) << "0.7 m apart";
  const Eigen::Isometry3d turned(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY()));
  EXPECT_TRUE(agreement.confirm(graph, proposal(11, 52, turned)).empty()) << "3 degrees apart, one step off";
  EXPECT_TRUE(agreement.confirm(graph, proposal(30, 53, ahead(0.0))).empty()) << "of another place";
}

TEST(LoopAgreement, AKeyFrameDoesNotConfirmItselfNorOneFarBack) {
  const PoseGraph graph = way();
  LoopAgreement agreement;
  agreement.confirm(graph, proposal(10, 50, ahead(0.0)));
  EXPECT_TRUE(agreement.confirm(graph, proposal(11, 50, ahead(-3.0))).empty());
  EXPECT_TRUE(agreement.confirm(graph, proposal(18, 58, ahead(0.0))).empty()) << "24 m farther";
}

TEST(LoopAgreement, OutlivesTheNodesOfItsProposals) {
  PoseGraph graph = way();
  LoopAgreement agreement;
  agreement.confirm(graph, proposal(0, 50, ahead(0.0)));
  graph.remove(0);
  EXPECT_TRUE(agreement.confirm(graph, proposal(1, 51, ahead(0.0))).empty());
}

}  // namespace sdvo::test_loop_agreement
