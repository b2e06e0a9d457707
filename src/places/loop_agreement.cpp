#include "stereo_descriptor_vo/places/loop_agreement.hpp"

#include <Eigen/Geometry>

namespace sdvo {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kRemembered = 20;

bool isShort(const GraphPath& path, double length) {
  return path.known && path.length <= length;
}

}  // namespace

LoopAgreement::LoopAgreement(const LoopAgreementOptions& options) : options_(checked(options)) {}

std::vector<GraphEdge> LoopAgreement::confirm(const PoseGraph& graph, const GraphEdge& proposal) {
  const auto& nodes = graph.nodes();
  const auto agrees = [&](const GraphEdge& earlier) {
    // Nodes may have been forgotten meanwhile.
    if (nodes.count(earlier.from) == 0 || nodes.count(earlier.to) == 0 || earlier.to == proposal.to) return false;
    if (!isShort(graph.path(earlier.from, proposal.from), options_.max_way) ||
        !isShort(graph.path(earlier.to, proposal.to), options_.max_way))
      return false;
    const Eigen::Isometry3d T_from_from = nodes.at(proposal.from).inverse() * nodes.at(earlier.from);
    const Eigen::Isometry3d T_to_to = nodes.at(earlier.to).inverse() * nodes.at(proposal.to);
    const Eigen::Isometry3d offset = proposal.T_from_to.inverse() * T_from_from * earlier.T_from_to * T_to_to;
    return offset.translation().norm() <= options_.max_translation &&
           Eigen::AngleAxisd(offset.linear()).angle() <= options_.max_rotation * kPi / 180.0;
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

}  // namespace sdvo
