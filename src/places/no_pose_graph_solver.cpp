#include <stdexcept>

#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace sdvo {

void requirePoseGraphSolver() {
  throw std::runtime_error(
      "places cannot be recognised: this package was built without Ceres; install libceres-dev and build it again");
}

void PoseGraph::solve(Summary&) {
  requirePoseGraphSolver();
}

}  // namespace sdvo
