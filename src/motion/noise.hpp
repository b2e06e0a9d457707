#pragma once

#include <algorithm>
#include <cmath>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// Least number of measurements for a variance, or for a motion that is compared with another one (chosen).
constexpr int kFewestMeasured = 20;

/// Weight of the previous mean in a running mean over confirmed pairs: a memory of about ten pairs (chosen).
constexpr double kUsualMemory = 0.9;

/// Side, px (chosen), of a square of the image within which the errors of patches and rectification are correlated.
constexpr double kCorrelatedSide = 24.0;

/// Cell of a position (px) in a grid over an image, row by row; the nearest cell for a position outside.
inline int gridCell(double u, double v, int width, int height, int columns, int rows) {
  // Clamped before it becomes an integer, which a position far outside of the image overflows.
  const auto index = [](double position, int size, int count) {
    return static_cast<int>(std::clamp(position * count / size, 0.0, count - 1.0));
  };
  return index(v, height, rows) * columns + index(u, width, columns);
}

/// The errors of measurements of a rig, and the differences of motions that follow from them.
class Noise {
 public:
  explicit Noise(const NoiseOptions& options) : options_(options) {}

  /// Updates the scale by the residuals of a confirmed motion's inliers (rms of u_left, v_left and u_right, px). The
  /// update is slow and bounded: one pair may be blurred, and the scale decides which points are inliers.
  void learn(double rms) {
    const double expected = options_.length() / std::sqrt(3.0);
    scale_ = std::clamp(kUsualMemory * scale_ + (1.0 - kUsualMemory) * rms / expected, 1.0 / kMost, kMost);
  }

  /// Ratio between the standard deviation of this rig's corners and the expected one.
  double scale() const { return scale_; }

  /// px: two motions are the same if they move most points to positions no further apart.
  double sameMotion() const { return scale_ * options_.length(); }

  /// px: two aligned positions that are further apart are not of one point.
  double alignedGate() const { return std::sqrt(2.0 * noiseGate(2)) * NoiseOptions::kReference; }

  /// Takes in the square, in standard deviations, by which the motion of a confirmed motion's lasting inliers (points
  /// with four confirmed sightings) differs from that of all. It is chi-square of six if points err independently.
  void learnShared(double square) { shared_ += (1.0 - kUsualMemory) * (square / 6.0 - shared_); }

  /// Takes in the median square, in standard deviations (chi-square of two), of a confirmed pair's residuals in the
  /// map.
  void learnPair(double square) {
    usual_square_ += (usual_square_ > 0.0 ? 1.0 - kUsualMemory : 1.0) * (clamped(square) - usual_square_);
  }

  /// Ratio between the variance of a pair's measurements and its running mean: images may be noisier, blurred or
  /// damaged. With few measurements it is shrunk to 1, as by kFewestMeasured measurements of the mean.
  double ofPair(double square, int measurements) const {
    if (usual_square_ == 0.0) return 1.0;
    return (kFewestMeasured + measurements * clamped(square) / usual_square_) / (kFewestMeasured + measurements);
  }

  /// Ratio between a motion's variance and the variance if the errors of its points were independent. Neighbours in the
  /// image share a part of their errors, which does not average out.
  double shared() const { return std::max(shared_, 1.0); }

 private:
  /// No less than a quarter of the expected square: identical images have residuals near 0, and ofPair() divides by
  /// their mean.
  static double clamped(double square) {
    constexpr double kMedian = 1.386;  // of chi-square of two: 2 log 2
    return std::max(square, kMedian / (kMost * kMost));
  }

  static constexpr double kMost = 2.0;  // ratio of standard deviations, and its inverse the least (chosen)
  // Ratio before any pair is learnt; the learnt one of real and rendered drives is 1 to 19 (KITTI 01).
  static constexpr double kSharedAtFirst = 4.0;
  NoiseOptions options_;
  double scale_ = 1.0;
  double shared_ = kSharedAtFirst;
  double usual_square_ = 0.0;
};

}  // namespace sdvo
