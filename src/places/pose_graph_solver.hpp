#pragma once

namespace sdvo {

/// Throws std::runtime_error where the package was built without Ceres: a graph could then grow, but not be optimised.
void requirePoseGraphSolver();

}  // namespace sdvo
