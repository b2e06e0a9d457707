#pragma once

#include <cstdint>
#include <vector>

#include "pixel_hits.hpp"
#include "world.hpp"

namespace sdvo::render {

/// What the first ray of every pixel has met, kept for a band of rows with those above and below it, and where that
/// calls for further rays.
class FirstHits {
 public:
  static constexpr int kBandHeight = 4;

  /// `materials` of the world's quadrilaterals; both must outlive this.
  FirstHits(int width, int height, const World& world, const std::vector<Material>& materials)
      : width_(width),
        height_(height),
        mesh_(&world.mesh),
        materials_(&materials),
        hits_(static_cast<std::size_t>(kKeptRows) * width),
        keys_(static_cast<std::size_t>(kKeptRows) * (width + 2)),
        differs_(static_cast<std::size_t>(kBandHeight) * width) {}

  Hit* row(int row) { return &hits_[static_cast<std::size_t>(row % kKeptRows) * width_]; }
  const Hit* row(int row) const { return &hits_[static_cast<std::size_t>(row % kKeptRows) * width_]; }

  /// To be called when the rows of the band that starts at `top` have been filled.
  void closeBand(int top);
  /// Finds the pixels of a band that have any neighbour that meets another surface; the bands above and below it must
  /// have been filled.
  void compareNeighbours(int top);
  /// What the last call found.
  bool differs(int row, int column) const {
    return differs_[static_cast<std::size_t>(row % kBandHeight) * width_ + column] != 0;
  }
  /// How many samples a pixel whose neighbours differ needs beyond its first: an edge that is followed over many frames
  /// deserves to be known better than foliage, of which every pixel is an edge.
  int furtherSamples(int row, int column) const;

 private:
  static constexpr int kKeptRows = 3 * kBandHeight;

  /// Keys of the hits of a row; those of the first and the last column are there twice.
  std::uint32_t* keyRow(int row) { return &keys_[static_cast<std::size_t>(row % kKeptRows) * (width_ + 2) + 1]; }
  bool lookAlike(const Hit& a, const Hit& b) const;
  bool isFoliage(const Hit& hit) const;

  const int width_, height_;
  const Mesh* mesh_;
  const std::vector<Material>* materials_;
  std::vector<Hit> hits_;
  std::vector<std::uint32_t> keys_;
  std::vector<std::uint32_t> differs_;  // of a band: not 0 where a neighbour meets another surface
};

}  // namespace sdvo::render
