#pragma once

namespace sdvo {

/// Where the samples lie in a patch: the middle, and what a step along x and along y of the square changes.
struct PatchPlacement {
  float x, y, x_by_x, x_by_y, y_by_x, y_by_y;
};

}  // namespace sdvo
