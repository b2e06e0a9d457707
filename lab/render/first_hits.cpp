#include "first_hits.hpp"

#include <algorithm>
#include <cmath>

namespace sdvo::render {

void FirstHits::closeBand(int top) {
  for (int r = top; r < std::min(top + kBandHeight, height_); ++r) {
    const Hit* hits = row(r);
    std::uint32_t* keys = keyRow(r);
    for (int column = 0; column < width_; ++column) keys[column] = hits[column].key;
    keys[-1] = keys[0];
    keys[width_] = keys[width_ - 1];
  }
}

void FirstHits::compareNeighbours(int top) {
  for (int r = top; r < std::min(top + kBandHeight, height_); ++r) {
    const std::uint32_t* above = keyRow(std::max(r - 1, 0));
    const std::uint32_t* here = keyRow(r);
    const std::uint32_t* below = keyRow(std::min(r + 1, height_ - 1));
    std::uint32_t* differs = &differs_[static_cast<std::size_t>(r - top) * width_];
    for (int column = 0; column < width_; ++column) {
      const std::uint32_t key = here[column];
      differs[column] = (above[column - 1] ^ key) | (above[column] ^ key) | (above[column + 1] ^ key) |
                        (here[column - 1] ^ key) | (here[column + 1] ^ key) | (below[column - 1] ^ key) |
                        (below[column] ^ key) | (below[column + 1] ^ key);
    }
  }
}

int FirstHits::furtherSamples(int row, int column) const {
  constexpr int kFew = kRegularSamples - 1;
  const Hit* row_hits = this->row(row);
  const Hit& here = row_hits[column];
  if (isFoliage(here)) return kFew;
  const Hit* const neighbours[] = {&row_hits[std::max(column - 1, 0)], &row_hits[std::min(column + 1, width_ - 1)],
                                   &this->row(std::max(row - 1, 0))[column],
                                   &this->row(std::min(row + 1, height_ - 1))[column]};
  for (const Hit* neighbour : neighbours)
    if (!isFoliage(*neighbour) && !lookAlike(here, *neighbour)) return kFew + kEdgeSamples;
  return kFew;
}

/// Whether two surfaces meet without an edge to be seen, as the sides of a post or the stones of a kerb do.
bool FirstHits::lookAlike(const Hit& a, const Hit& b) const {
  if (a.isSame(b)) return true;
  if (a.car != Hit::kStatic || b.car != Hit::kStatic) return false;
  if ((*materials_)[a.quad] != (*materials_)[b.quad] || std::abs(a.depth - b.depth) > 0.02f * a.depth) return false;
  const Surface &one = mesh_->surfaces[a.quad], &other = mesh_->surfaces[b.quad];
  return std::abs(one.albedo - other.albedo) < 0.1f && mesh_->normal(a.quad).dot(mesh_->normal(b.quad)) > 0.7f;
}

bool FirstHits::isFoliage(const Hit& hit) const {
  if (hit.car != Hit::kStatic) return false;
  const Material material = (*materials_)[hit.quad];
  return material == Material::kLeaf || material == Material::kFoliage;
}

}  // namespace sdvo::render
