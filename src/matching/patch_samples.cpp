#include "patch_samples.hpp"

#include <algorithm>

#include "../common/registers.hpp"

namespace sdvo {
namespace {

constexpr int kRow = 16;  // numbers of a row in registers: whole ones
static_assert(kLeastPatchSide < kRow, "a pixel more than the samples is read");
static_assert(kSampledSide * kSampledSide + kRow <= kSamples, "a row is written at once");

/// The square's values and derivatives; its middle lies at (x, y) of the patch.
struct SampleUpright {
  static SDVO_IN_KERNEL void run(const std::uint8_t* patch, int side, float x, float y, float* values, float* by_x,
                                 float* by_y) {
    constexpr int reach = kAlignedRadius + 1;
    const int last = side - 2;
    const int column = std::clamp(static_cast<int>(x - static_cast<float>(reach)), 0, last);
    float a[kRow];
    for (int i = 0; i < kRow; ++i) a[i] = (x + static_cast<float>(i - reach)) - static_cast<float>(column + i);
    float around[kLeastPatchSide * kRow + kRow];
    for (int j = 0; j <= 2 * reach; ++j) {
      const float v = y + static_cast<float>(j - reach);
      const int row = std::clamp(static_cast<int>(v), 0, last);
      const float b = v - static_cast<float>(row);
      const std::uint8_t *upper = patch + row * side + column, *lower = upper + side;
      for (int i = 0; i < kRow; ++i) {
        const float above = upper[i] + a[i] * static_cast<float>(upper[i + 1] - upper[i]);
        const float below = lower[i] + a[i] * static_cast<float>(lower[i + 1] - lower[i]);
        around[j * kRow + i] = above + b * (below - above);
      }
    }
    std::fill_n(around + (2 * reach + 1) * kRow, kRow, 0.f);

    // What is written beyond a row is overwritten by the next one.
    constexpr int columns = kSampledSide;
    for (int j = 0; j < columns; ++j)
      for (int i = 0; i < kRow; i += 8) {
        const float* here = around + (j + 1) * kRow + 1 + i;
        Lanes centre, left, right, above, below;
        load(here, centre), load(here - 1, left), load(here + 1, right);
        load(here - kRow, above), load(here + kRow, below);
        const int k = j * columns + i;
        store(centre, values + k);
        store(0.5f * (right - left), by_x + k), store(0.5f * (below - above), by_y + k);
      }
    for (float* of : {values, by_x, by_y}) std::fill_n(of + columns * columns, kRow, 0.f);
  }
};

/// Interpolates between the byte at each place and its right neighbour.
SDVO_IN_KERNEL Register between(const std::uint8_t* bytes, const std::uint32_t* places, Register share) {
  const UnsignedRegister bits = readFours(bytes, places);
  const UnsignedRegister first = bits & 255, second = bits >> 8 & 255;
  return toFloats(first) + share * toFloats(second - first);
}

/// A register of samples at once.
struct SampleGrid {
  static SDVO_IN_KERNEL void run(const std::uint8_t* patch, int side, const PatchPlacement* at, const float* dx,
                                 const float* dy, const float* mask, int count, float* values) {
    const IntRegister last = IntRegister{} + (side - 2);
    for (int k = 0; k < count; k += kRegister) {
      Register over, down, counts;
      load(dx + k, over), load(dy + k, down), load(mask + k, counts);
      const Register x = at->x + at->x_by_x * over + at->x_by_y * down;
      const Register y = at->y + at->y_by_x * over + at->y_by_y * down;
      // Rounding may lead a hair outside of the square that was checked: clamped.
      const IntRegister column = truncated(x, last), row = truncated(y, last);
      const Register a = x - __builtin_convertvector(column, Register), b = y - __builtin_convertvector(row, Register);
      std::uint32_t places[kRegister];
      store(row * side + column, places);
      const Register upper = between(patch, places, a), lower = between(patch + side, places, a);
      store((upper + b * (lower - upper)) * counts, values + k);
    }
  }
};

}  // namespace

SampleSquare::SampleSquare() {
  for (int j = 0; j < side(); ++j)
    for (int i = 0; i < side(); ++i) {
      const std::size_t k = static_cast<std::size_t>(j * side() + i);
      x_[k] = static_cast<float>(i - kAlignedRadius), y_[k] = static_cast<float>(j - kAlignedRadius);
      mask_[k] = 1.f;
    }
}

void PaddedPatch::take(const Patch& patch) {
  const std::size_t bytes = static_cast<std::size_t>(patch.side * patch.side);
  samples_.resize(bytes + static_cast<std::size_t>(patch.side + 2 * kRow));
  std::copy_n(patch.samples, bytes, samples_.begin());
  side_ = patch.side;
}

bool SampleSquare::sample(const PaddedPatch& patch, const Eigen::Vector2f& centre, const Eigen::Matrix2f& grid,
                          Samples& values) const {
  const float half = 0.5f * static_cast<float>(patch.side() - 1);
  const Eigen::Vector2f reach = static_cast<float>(kAlignedRadius) * grid.cwiseAbs().rowwise().sum();
  if (!((centre.cwiseAbs() + reach).maxCoeff() <= half)) return false;
  const PatchPlacement at{half + centre.x(), half + centre.y(), grid(0, 0), grid(0, 1), grid(1, 0), grid(1, 1)};
  runKernel<SampleGrid>(patch.samples(), patch.side(), &at, x_.data(), y_.data(), mask_.data(), count(), values.data());
  return true;
}

bool SampleSquare::sampleUpright(const PaddedPatch& patch, const Eigen::Vector2f& centre, Samples& values,
                                 Samples& by_x, Samples& by_y) const {
  const float half = 0.5f * static_cast<float>(patch.side() - 1);
  if (!(centre.cwiseAbs().maxCoeff() + static_cast<float>(kAlignedRadius + 1) <= half)) return false;
  runKernel<SampleUpright>(patch.samples(), patch.side(), half + centre.x(), half + centre.y(), values.data(),
                           by_x.data(), by_y.data());
  return true;
}

}  // namespace sdvo
