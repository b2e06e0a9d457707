#pragma once

#include <cstddef>
#include <cstdint>

namespace sdvo {

/// Columns of a block: one register. It reaches from 8 px left of its centre to 7 px right of it.
constexpr int kBlockWidth = 16;

/// Sums of absolute differences between a block of 2 kRows + 1 rows centred at `block` and `count` blocks. The first of
/// these is centred at `others`, each next one a pixel further left. One column more on the right may be read. Rows of
/// both images are `step` bytes apart. For kRows of 4 and 5.
template <int kRows>
void blockDifferences(const std::uint8_t* block, const std::uint8_t* others, std::ptrdiff_t step, int count,
                      unsigned* differences);

}  // namespace sdvo
