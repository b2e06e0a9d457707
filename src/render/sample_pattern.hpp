#pragma once

namespace sdvo::render {

/// Place of a sample within a pixel, relative to its centre, px.
struct SampleOffset {
  float x, y;
};

/// The four regular samples of a pixel are the corners of a square that is turned about the pixel's centre, so that
/// they lie in four rows and four columns. Neighbours take squares that differ a little, so that an edge along several
/// pixels is known better than to a quarter. The first sample of each of 4 x 4 pixels is another corner in every row
/// and in every column of them: what is a quarter of a pixel wide and four pixels long is met by first samples alone.
inline SampleOffset regularSample(int row, int column, int sample) {
  static constexpr int kFirst[4][4] = {{0, 1, 2, 3}, {2, 3, 0, 1}, {3, 2, 1, 0}, {1, 0, 3, 2}};
  static constexpr int kSquares[4][2] = {{3, 12}, {13, -4}, {11, -4}, {5, 12}};  // a corner; unit: 1/32 px
  const int(&square)[2] = kSquares[2 * (row % 2) + column % 2];
  const auto a = static_cast<float>(square[0]) / 32.0f, b = static_cast<float>(square[1]) / 32.0f;
  switch ((kFirst[row % 4][column % 4] + sample) % 4) {
    case 0:
      return {a, b};
    case 1:
      return {-b, a};
    case 2:
      return {-a, -b};
    default:
      return {b, -a};
  }
}
constexpr int kRegularSamples = 4;

/// Four further samples of a pixel on an edge, in the gaps that the regular ones leave: the corners of another square,
/// turned the other way.
inline SampleOffset edgeSample(int sample) {
  constexpr float kA = -8.0f / 32.0f, kB = 15.0f / 32.0f;
  constexpr SampleOffset kCorners[] = {{kA, kB}, {-kB, kA}, {-kA, -kB}, {kB, -kA}};
  return kCorners[sample];
}
constexpr int kEdgeSamples = 4;

/// Sixteen samples, no two in one row or column of a 16 x 16 raster; their mean is the pixel's centre.
inline SampleOffset fineSample(int sample) {
  return {(static_cast<float>(sample % 4 * 4 + sample / 4) + 0.5f) / 16.0f - 0.5f,
          (static_cast<float>(sample / 4 * 4 + sample % 4) + 0.5f) / 16.0f - 0.5f};
}
constexpr int kFineSamples = 16;

}  // namespace sdvo::render
