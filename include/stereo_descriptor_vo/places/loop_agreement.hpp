#pragma once

#include <deque>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace sdvo {

struct LoopAgreementOptions {
  double max_way = 20.0;
  double max_translation = 0.5;
  double max_rotation = 2.0;

  void describe(OptionList& list) {
    list.add("max_way", max_way, {0.1, 1000.0}, "m", "a loop needs a second one not farther back on the way than this");
    list.add("max_translation", max_translation, {0.001, 100.0}, "m",
             "… that puts the camera at the same spot within this");
    list.add("max_rotation", max_rotation, {0.01, 180.0}, "deg", "… and in the same direction within this");
  }
};

/// A place that was recognised once may be an accident; two neighbouring key frames that say the same are none.
class LoopAgreement {
 public:
  explicit LoopAgreement(const LoopAgreementOptions& options);

  /// The loops that can be trusted now: none, or this one and those before it that it is the first to agree with.
  std::vector<GraphEdge> confirm(const PoseGraph& graph, const GraphEdge& proposal);

 private:
  struct Proposal {
    GraphEdge loop;
    bool trusted;
  };

  LoopAgreementOptions options_;
  std::deque<Proposal> proposals_;  ///< of the last few key frames
};

}  // namespace sdvo
