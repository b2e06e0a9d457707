#pragma once

namespace sdvo::render {

/// Place of a sample within a pixel, relative to its centre, px.
struct SampleOffset {
  float x, y;
};

/// The regular samples of a pixel lie in the four quarters of its width and of its height. Neighbours take a set as it
/// is, turned by half a turn, or either one transposed, so that an edge along several pixels is known better than along
/// one. Unit: 1/16 px.
constexpr signed char kSampleSets[4][4][2] = {{{-7, -1}, {-3, -5}, {3, 7}, {5, 1}},
                                              {{-5, -1}, {-3, -7}, {3, 5}, {7, 1}},
                                              {{-5, -3}, {-1, -7}, {1, 5}, {7, 3}},
                                              {{-7, -3}, {-1, -5}, {1, 7}, {5, 3}}};

/// The first sample of each of 4 x 4 pixels lies in another quarter of the width in every row, and of the height in
/// every column: what is a quarter of a pixel wide and four pixels long is met by first samples alone.
inline SampleOffset regularSample(int row, int column, int sample) {
  static constexpr int kFirst[4][4] = {{0, 1, 2, 3}, {2, 3, 0, 1}, {3, 2, 1, 0}, {1, 0, 3, 2}};
  const signed char(&place)[2] = kSampleSets[2 * (row % 2) + column % 2][(kFirst[row % 4][column % 4] + sample) % 4];
  return {static_cast<float>(place[0]) / 16.0f, static_cast<float>(place[1]) / 16.0f};
}
constexpr int kRegularSamples = 4;

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
