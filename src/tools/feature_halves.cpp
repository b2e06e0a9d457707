#include "feature_halves.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace sdvo {
namespace {

/// Fields over the height of the image. Errors of neighbours are correlated and must stay in one half: with 8 fields
/// the halves differ by up to a third less. With 2 fields a half covers the image badly.
constexpr int kFields = 4;

/// Largest distance (px) of a previous feature from the start of a flow that belongs to it: a few corner errors.
constexpr float kSamePoint = 2.f;

int halfOfField(float u, float v, int height) {
  const float side = std::max(1.f, static_cast<float>(height) / kFields);
  return (static_cast<int>(u / side) + static_cast<int>(v / side)) % 2;
}

}  // namespace

std::array<std::vector<int>, 2> FeatureHalves::split(const StereoFeatures& features,
                                                     const std::vector<FeatureFlow>& flow) {
  const auto count = static_cast<std::size_t>(features.count());
  std::vector<int> half(count);
  for (std::size_t i = 0; i < count; ++i) half[i] = halfOfField(features.u[i], features.v[i], features.camera.height);
  for (const FeatureFlow& match : flow)
    if (const int before = halfOfPrevious(match.u_previous, match.v_previous); before >= 0)
      half[static_cast<std::size_t>(match.current)] = before;

  std::array<std::vector<int>, 2> indices;
  for (std::size_t i = 0; i < count; ++i) indices[static_cast<std::size_t>(half[i])].push_back(static_cast<int>(i));
  u_ = features.u, v_ = features.v, half_ = std::move(half);
  return indices;
}

/// -1 where the previous pair had no feature.
int FeatureHalves::halfOfPrevious(float u, float v) const {
  float nearest = kSamePoint * kSamePoint;
  int half = -1;
  for (std::size_t i = 0; i < u_.size(); ++i) {
    const float du = u_[i] - u, dv = v_[i] - v, square = du * du + dv * dv;
    if (square < nearest) nearest = square, half = half_[i];
  }
  return half;
}

}  // namespace sdvo
