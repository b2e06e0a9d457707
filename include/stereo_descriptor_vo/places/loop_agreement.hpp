#pragma once

#include <deque>
#include <vector>

#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace sdvo {

/// A place that was recognised once may be an accident; two neighbouring key frames that say the same are none.
class LoopAgreement {
 public:
  /// The loops that can be trusted now: none, or this one and those before it that it is the first to agree with.
  std::vector<GraphEdge> confirm(const PoseGraph& graph, const GraphEdge& proposal);

 private:
  struct Proposal {
    GraphEdge loop;
    bool trusted;
  };

  std::deque<Proposal> proposals_;  ///< of the last few key frames
};

}  // namespace sdvo
