#pragma once

#include <array>

namespace sdvo::render {

/// Place of a sample within a pixel, relative to its centre, px.
struct SampleOffset {
  float x, y;
};

/// Pixels are sampled in tiles of this width, which are decided upon together.
constexpr int kTileWidth = 4;

/// The four regular samples of a pixel; `tile_row` is 0 or 1. The first two lie opposite each other, as do the others:
/// the mean of either pair is the pixel's centre. Neighbouring pixels take different sets, so that an edge along
/// several of them is known better than to a quarter. The first pair of a tile's corner pixels reaches towards its
/// corners, that of the inner columns towards its upper and lower border: hardly anything that enters a tile goes
/// unnoticed.
inline SampleOffset regularSample(int tile_row, int tile_column, int sample) {
  static constexpr int kSets[4][4][2] = {{{-15, -13}, {15, 13}, {5, -5}, {-5, 5}},  // unit: 1/32 px
                                         {{-11, 15}, {11, -15}, {1, 3}, {-1, -3}},
                                         {{-3, -15}, {3, 15}, {11, -5}, {-11, 5}},
                                         {{7, -13}, {-7, 13}, {15, 3}, {-15, -3}}};
  static constexpr int kSetOf[2][kTileWidth] = {{0, 2, 3, 1}, {1, 3, 2, 0}};
  const int(&place)[2] = kSets[kSetOf[tile_row][tile_column]][sample];
  return {static_cast<float>(place[0]) / 32.0f, static_cast<float>(place[1]) / 32.0f};
}

/// Further samples of a pixel on an edge: no two in one row or column of an 8 x 8 raster; their mean is the pixel's
/// centre.
inline SampleOffset edgeSample(int sample) {
  return {(static_cast<float>(sample) + 0.5f) / 8.0f - 0.5f,
          (static_cast<float>((3 * sample + 1) % 8) + 0.5f) / 8.0f - 0.5f};
}
constexpr int kEdgeSamples = 8;

/// Sixteen samples, no two in one row or column of a 16 x 16 raster; their mean is the pixel's centre.
inline SampleOffset fineSample(int sample) {
  return {(static_cast<float>(sample % 4 * 4 + sample / 4) + 0.5f) / 16.0f - 0.5f,
          (static_cast<float>(sample / 4 * 4 + sample % 4) + 0.5f) / 16.0f - 0.5f};
}
constexpr int kFineSamples = 16;

}  // namespace sdvo::render
