#pragma once

#include <Eigen/Geometry>
#include <deque>
#include <opencv2/core.hpp>
#include <set>
#include <vector>

#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace sdvo {

/// Accepts a loop only if another one, of neighbouring key frames, gives the same relative pose. A single one may be
/// wrong by chance.
class LoopAgreement {
 public:
  /// The loops that are newly trusted: none, or this one and the earlier ones that it is the first to agree with.
  std::vector<GraphEdge> confirm(const PoseGraph& graph, const GraphEdge& proposal) {
    const auto& nodes = graph.nodes();
    const std::set<int> near_from = graph.near(proposal.from, kLongestPath);
    const std::set<int> near_to = graph.near(proposal.to, kLongestPath);
    // Nodes that were removed meanwhile are in neither set.
    const auto agrees = [&](const GraphEdge& earlier) {
      if (near_from.count(earlier.from) == 0 || near_to.count(earlier.to) == 0 || earlier.to == proposal.to)
        return false;
      const Eigen::Isometry3d T_from_earlier = nodes.at(proposal.from).inverse() * nodes.at(earlier.from);
      const Eigen::Isometry3d T_earlier_to = nodes.at(earlier.to).inverse() * nodes.at(proposal.to);
      const Eigen::Isometry3d offset = proposal.T_from_to.inverse() * T_from_earlier * earlier.T_from_to * T_earlier_to;
      return offset.translation().norm() <= kLargestTranslation &&
             Eigen::AngleAxisd(offset.linear()).angle() <= kLargestRotation * CV_PI / 180.0;
    };

    std::vector<GraphEdge> trusted;
    bool confirmed = false;
    for (Proposal& earlier : proposals_) {
      if (!agrees(earlier.loop)) continue;
      confirmed = true;
      if (!earlier.trusted) trusted.push_back(earlier.loop);
      earlier.trusted = true;
    }
    if (confirmed) trusted.push_back(proposal);
    proposals_.push_back({proposal, confirmed});
    if (proposals_.size() > kRemembered) proposals_.pop_front();
    return trusted;
  }

 private:
  static constexpr std::size_t kRemembered = 20;
  static constexpr double kLongestPath = 20.0;        // m (chosen) travelled between the ends of two loops
  static constexpr double kLargestTranslation = 0.5;  // m (chosen) between the camera's positions by two loops
  static constexpr double kLargestRotation = 2.0;     // deg (chosen) between its orientations by them

  struct Proposal {
    GraphEdge loop;
    bool trusted;
  };

  std::deque<Proposal> proposals_;  ///< of the last few key frames
};

}  // namespace sdvo
