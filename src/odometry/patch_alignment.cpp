#include "stereo_descriptor_vo/odometry/patch_alignment.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace sdvo {
namespace {

constexpr int kLargestSide = 2 * PatchAlignmentOptions::kLargestRadius + 1;
using Samples = Eigen::Array<float, Eigen::Dynamic, 1, 0, kLargestSide * kLargestSide, 1>;

/// Samples a patch on the square of side 2 radius + 1 around `centre` whose grid is taken there by `grid` (all in
/// samples of the patch, from its middle), bilinearly. False when a corner of that square lies outside.
bool sampleSquare(const Patch& patch, const Eigen::Vector2f& centre, const Eigen::Matrix2f& grid, int radius,
                  Samples& values) {
  const float half = 0.5f * static_cast<float>(patch.side - 1), r = static_cast<float>(radius);
  const Eigen::Vector2f reach = r * grid.cwiseAbs().rowwise().sum();
  if (!((centre.cwiseAbs() + reach).maxCoeff() <= half)) return false;
  const int last = patch.side - 2;
  const float step_x = grid(0, 0), step_y = grid(1, 0);
  values.resize((2 * radius + 1) * (2 * radius + 1));
  float* value = values.data();
  for (int j = -radius; j <= radius; ++j) {
    float x = half + centre.x() + grid(0, 1) * static_cast<float>(j) - grid(0, 0) * r;
    float y = half + centre.y() + grid(1, 1) * static_cast<float>(j) - grid(1, 0) * r;
    for (int i = -radius; i <= radius; ++i, x += step_x, y += step_y) {
      // Rounding may lead a hair outside of the square that was checked.
      const int column = std::clamp(static_cast<int>(x), 0, last), row = std::clamp(static_cast<int>(y), 0, last);
      const float a = x - static_cast<float>(column), b = y - static_cast<float>(row);
      const std::uint8_t* sample = patch.samples + row * patch.side + column;
      const float upper = sample[0] + a * static_cast<float>(sample[1] - sample[0]);
      const float lower = sample[patch.side] + a * static_cast<float>(sample[patch.side + 1] - sample[patch.side]);
      *value++ = upper + b * (lower - upper);
    }
  }
  return true;
}

/// The reference's pixels and their derivatives, without their means.
struct Template {
  Samples grey, by_x, by_y;
  float square = 0.f;  ///< sum of the pixels' squares
  Eigen::Matrix2f hessian;
};

std::optional<Template> makeTemplate(const Patch& reference, const Eigen::Vector2f& centre, int radius) {
  constexpr float kFlat = 1.f;        // grey level: less contrast than this is noise
  constexpr float kOneSided = 1e-3f;  // of the hessian's two directions: an edge holds no position along itself
  Template result;
  const Eigen::Matrix2f upright = Eigen::Matrix2f::Identity();
  Samples right, left, below, above;
  if (!sampleSquare(reference, centre, upright, radius, result.grey) ||
      !sampleSquare(reference, centre + Eigen::Vector2f::UnitX(), upright, radius, right) ||
      !sampleSquare(reference, centre - Eigen::Vector2f::UnitX(), upright, radius, left) ||
      !sampleSquare(reference, centre + Eigen::Vector2f::UnitY(), upright, radius, below) ||
      !sampleSquare(reference, centre - Eigen::Vector2f::UnitY(), upright, radius, above))
    return std::nullopt;
  result.by_x = 0.5f * (right - left);
  result.by_y = 0.5f * (below - above);
  for (Samples* values : {&result.grey, &result.by_x, &result.by_y}) *values -= values->mean();
  result.square = result.grey.square().sum();
  const float xx = result.by_x.square().sum(), xy = (result.by_x * result.by_y).sum(), yy = result.by_y.square().sum();
  result.hessian << xx, xy, xy, yy;
  if (!(result.square > kFlat * kFlat * static_cast<float>(result.grey.size())) ||
      !(xx * yy - xy * xy > kOneSided * xx * yy))
    return std::nullopt;
  return result;
}

}  // namespace

std::optional<PatchShift> alignPatch(const PatchAlignmentOptions& options, const Patch& reference,
                                     const Eigen::Vector2f& centre, const Patch& current, const Eigen::Matrix2f& warp) {
  constexpr int kIterations = 10;
  constexpr float kConverged = 0.02f;  // samples
  const std::optional<Template> pattern = makeTemplate(reference, centre, options.radius);
  if (!pattern) return std::nullopt;
  const Eigen::Matrix2f inverse = pattern->hessian.inverse();
  const Eigen::Matrix2f grid = warp * (reference.spacing / current.spacing);
  const float largest = static_cast<float>(options.max_shift) / current.spacing;

  Eigen::Vector2f position = Eigen::Vector2f::Zero();
  Samples grey;
  float square = 0.f, product = 0.f;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    if (!sampleSquare(current, position, grid, options.radius, grey)) return std::nullopt;
    grey -= grey.mean();
    square = grey.square().sum();
    product = (pattern->grey * grey).sum();
    if (!(product > 0.f)) return std::nullopt;
    grey = (pattern->square / product) * grey - pattern->grey;
    const Eigen::Vector2f gradient((pattern->by_x * grey).sum(), (pattern->by_y * grey).sum());
    const Eigen::Vector2f step = inverse * gradient;
    position -= grid * step;
    if (!(position.cwiseAbs().maxCoeff() <= largest)) return std::nullopt;
    if (step.cwiseAbs().maxCoeff() < kConverged) break;
  }

  PatchShift found;
  found.shift = current.spacing * position;
  found.correlation = product / std::sqrt(pattern->square * square);
  if (!(found.correlation >= static_cast<float>(options.min_correlation))) return std::nullopt;
  // What is left of the difference is noise of the images, four parameters fitted, and so tells the position's.
  const float noise = grey.square().sum() / static_cast<float>(grey.size() - 4);
  const float scale = reference.spacing * reference.spacing;
  const float floor = static_cast<float>(options.min_sigma);
  found.sigma = std::sqrt(0.5f * noise * inverse.trace() * scale + floor * floor);
  return found;
}

}  // namespace sdvo
