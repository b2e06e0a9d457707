#pragma once

#include <deque>
#include <vector>

#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace sdvo {

/// Accepts a loop only if another one, of neighbouring key frames, gives the same relative pose. A single one may be
/// wrong by chance.
class LoopAgreement {
 public:
  /// The loops that are newly trusted: none, or this one and the earlier ones that it is the first to agree with.
  std::vector<GraphEdge> confirm(const PoseGraph& graph, const GraphEdge& proposal);

 private:
  struct Proposal {
    GraphEdge loop;
    bool trusted;
  };

  std::deque<Proposal> proposals_;  ///< of the last few key frames
};

}  // namespace sdvo
