#pragma once

#include <array>
#include <cstddef>

namespace sdvo {

// The circle of FAST (Rosten and Drummond 2006) around a pixel.
constexpr std::size_t kCircle = 16;  // pixels on it, clockwise from above
constexpr std::array<int, kCircle> kCircleX = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr std::array<int, kCircle> kCircleY = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};

}  // namespace sdvo
