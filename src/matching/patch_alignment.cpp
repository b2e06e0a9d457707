#include "patch_alignment.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "../common/kernel.hpp"
#include "../common/text.hpp"
#include "patch_samples.hpp"

namespace sdvo {
namespace {

/// Products of the current patch with the pattern and its two derivatives.
struct Project {
  static SDVO_IN_KERNEL void run(int count, const float* grey, const float* pattern, const float* by_x,
                                 const float* by_y, float* product, float* by_shift) {
    Lanes along_pattern{}, along_x{}, along_y{};
    for (int k = 0; k < count; k += 8) {
      Lanes g, p, x, y;
      load(grey + k, g), load(pattern + k, p), load(by_x + k, x), load(by_y + k, y);
      along_pattern += p * g, along_x += x * g, along_y += y * g;
    }
    *product = sumOf(along_pattern), by_shift[0] = sumOf(along_x), by_shift[1] = sumOf(along_y);
  }
};

/// Subtracts the mean where the mask is 1; where it is 0, values are 0. `pixels` is the sum of the mask.
struct RemoveMean {
  static SDVO_IN_KERNEL void run(int count, float pixels, const float* mask, float* values) {
    Lanes sum{};
    for (int k = 0; k < count; k += 8) {
      Lanes v;
      load(values + k, v);
      sum += v;
    }
    const float mean = sumOf(sum) / pixels;
    for (int k = 0; k < count; k += 8) {
      Lanes v, m;
      load(values + k, v), load(mask + k, m);
      store(v - mean * m, values + k);
    }
  }
};

struct SumProducts {
  static SDVO_IN_KERNEL void run(int count, const float* a, const float* b, const float* c, Products<float>* sums) {
    Products<Lanes> products;
    for (int k = 0; k < count; k += 8) {
      Lanes u, v, w;
      load(a + k, u), load(b + k, v), load(c + k, w);
      products.add(u, v, w);
    }
    *sums = sumOf(products);
  }
};

void removeMean(const SampleSquare& square, Samples& values) {
  runKernel<RemoveMean>(square.count(), static_cast<float>(square.pixels()), square.mask(), values.data());
}

Products<float> multiply(int count, const float* a, const float* b, const float* c) {
  Products<float> products;
  runKernel<SumProducts>(count, a, b, c, &products);
  return products;
}

/// Sum of (contrast * grey - pattern)^2.
float sumOfSquaredDifferences(int count, float contrast, const float* grey, const float* pattern) {
  float sum = 0.f;
  for (int k = 0; k < count; ++k) {
    const float difference = contrast * grey[k] - pattern[k];
    sum += difference * difference;
  }
  return sum;
}

/// The reference's pixels and their derivatives, without their means.
struct Template {
  Samples grey, by_x, by_y;
  float square = 0.f;        ///< sum of the pixels' squares
  Eigen::Vector2f gradient;  ///< products of the derivatives with the pixels
  Eigen::Matrix2f hessian;
};

bool makeTemplate(const PaddedPatch& reference, const Eigen::Vector2f& centre, const SampleSquare& square,
                  Template& result) {
  constexpr float kFlat = 1.f;  // grey level: less contrast than this is noise
  // Least determinant of the hessian, per product of its diagonal: an edge does not constrain the position along it.
  constexpr float kOneSided = 1e-3f;
  if (!square.sampleUpright(reference, centre, result.grey, result.by_x, result.by_y)) return false;
  for (Samples* values : {&result.grey, &result.by_x, &result.by_y}) removeMean(square, *values);
  const Products<float> p = multiply(square.count(), result.by_x.data(), result.by_y.data(), result.grey.data());
  result.hessian << p.aa, p.ab, p.ab, p.bb;
  result.gradient = {p.ac, p.bc};
  result.square = p.cc;
  return result.square > kFlat * kFlat * static_cast<float>(square.pixels()) &&
         p.aa * p.bb - p.ab * p.ab > kOneSided * p.aa * p.bb;
}

}  // namespace

std::string alignmentComplaint(int patch_side) {
  if (patch_side == 0 || canAlign(patch_side)) return "";
  return text(0, "patches of ", patch_side, "x", patch_side,
              " samples are too small for the alignment: no match is aligned; descriptor/patch_side of stereo_features "
              "must be ",
              kLeastPatchSide, " or more");
}

std::optional<PatchShift> alignPatch(const NoiseOptions& noise, const Patch& reference, const Eigen::Vector2f& centre,
                                     const Patch& current, const Eigen::Matrix2f& warp) {
  constexpr int kIterations = 10;
  constexpr float kConverged = 0.02f;        // samples
  constexpr float kLeastCorrelation = 0.7f;  // of the aligned patches
  static const SampleSquare square;
  thread_local PaddedPatch near_reference, near_current;
  near_reference.take(reference), near_current.take(current);
  Template pattern;
  if (!makeTemplate(near_reference, centre, square, pattern)) return std::nullopt;
  const Eigen::Matrix2f inverse = pattern.hessian.inverse();
  const Eigen::Matrix2f grid = warp * (reference.spacing / current.spacing);
  const float largest = static_cast<float>(noise.cornerGate()) / current.spacing;

  Eigen::Vector2f position = Eigen::Vector2f::Zero();
  Samples grey;
  float contrast = 1.f;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    if (!square.sample(near_current, position, grid, grey)) return std::nullopt;
    // The pattern and its derivatives have no mean, so the current patch's mean has no effect.
    float product;
    Eigen::Vector2f products;
    runKernel<Project>(square.count(), grey.data(), pattern.grey.data(), pattern.by_x.data(), pattern.by_y.data(),
                       &product, products.data());
    if (!(product > 0.f)) return std::nullopt;
    contrast = pattern.square / product;
    const Eigen::Vector2f gradient = contrast * products - pattern.gradient;
    const Eigen::Vector2f step = inverse * gradient;
    position -= grid * step;
    if (!(position.cwiseAbs().maxCoeff() <= largest)) return std::nullopt;
    if (step.cwiseAbs().maxCoeff() < kConverged) break;
  }

  removeMean(square, grey);
  const Products<float> p = multiply(square.count(), grey.data(), pattern.grey.data(), pattern.grey.data());
  PatchShift found;
  found.shift = current.spacing * position;
  found.correlation = p.ab / std::sqrt(pattern.square * p.aa);
  if (!(found.correlation >= kLeastCorrelation)) return std::nullopt;
  // The position's variance follows from the remaining difference, with four parameters fitted. This is about the noise
  // of one image, because interpolation smooths the other one. Noise of the reference moves the position by its warped
  // amount. Noise of the current patch does so, too, but not by less than unwarped: where the point appears smaller,
  // neighbouring values share samples.
  const float left = sumOfSquaredDifferences(square.count(), contrast, grey.data(), pattern.grey.data());
  const float variance = left / static_cast<float>(square.pixels() - 4);
  const float warped = (grid * inverse * grid.transpose()).trace(), own = std::max(warped, inverse.trace());
  found.sigma = current.spacing * std::hypot(std::sqrt(0.5f * variance * (warped + own)), kConverged);
  return found;
}

}  // namespace sdvo
