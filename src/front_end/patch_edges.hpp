#pragma once

#include <array>

#include "stereo_descriptor_vo/front_end/patch_cutter.hpp"

namespace sdvo {

/// The squares tile, so each edge serves two of them. Arrays go on to whole registers.
constexpr int kMostEdges = (PatchOptions::kMostSamples + 1 + 7) / 8 * 8;
using PerEdge = std::array<float, kMostEdges>;

/// Positions between two columns or two rows of the integral.
struct PatchEdges {
  std::array<int, kMostEdges> index;
  PerEdge share;  ///< of the second one
  PerEdge width;  ///< from here to the next edge; none behind the last one
};

}  // namespace sdvo
