#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Probability that chance exceeds the limits of this package, for normal distributions as well as for agreement.
constexpr double kTailProbability = 1e-4;

/// Fewer measurements tell neither their spread nor a motion of their own from noise (chosen).
constexpr int kFewestMeasured = 20;

/// Of what is usual: ratio of the past that a pair leaves, which are some ten pairs (chosen).
constexpr double kUsualMemory = 0.9;

/// px (chosen): patches and rectification err alike within such a part of the image.
constexpr double kPart = 24.0;

/// Square, in standard deviations, that so many normally distributed numbers exceed with that probability (chi-square).
constexpr double noiseGate(int numbers) {
  constexpr double gates[] = {15.14, 18.42, 21.11, 23.51, 25.74, 27.86};
  return gates[numbers - 1];
}

/// The errors of measurements, and the differences of motions that follow from them. Standard deviations in px.
class Noise {
 public:
  /// Of a detected corner and of a position by its patch, in each direction, and of a disparity.
  Noise(double corner, double aligned, double disparity) : corner_(corner), aligned_(aligned), disparity_(disparity) {}

  /// Takes in what the inliers of a confirmed motion were off by (rms of u_left, v_left and u_right, px). Slow and
  /// bounded: one pair may be blurred, and what the inliers are depends on the scale itself.
  void learn(double rms) {
    constexpr double kMost = 2.0;  // (chosen)
    const double expected = std::sqrt(2.0 * corner_ * corner_ + disparity_ * disparity_ / 3.0);
    scale_ = std::clamp(kUsualMemory * scale_ + (1.0 - kUsualMemory) * rms / expected, 1.0 / kMost, kMost);
  }

  /// By how much this rig's corners err more than expected.
  double scale() const { return scale_; }

  /// px: root mean square length (u_left, v_left, u_right) between a corner and the map's point. Motions that are
  /// closer at most points are one.
  double sameMotion() const { return scale_ * std::sqrt(6.0) * corner_; }

  /// px: two aligned positions that are further apart are not of one point.
  double elsewhere() const { return std::sqrt(2.0 * noiseGate(2)) * aligned_; }

  /// Takes in the square, in standard deviations (chi-square of six), by which the motions of two parts of a confirmed
  /// motion's inliers differ.
  void learnShared(double square) { shared_ += (1.0 - kUsualMemory) * (square / 6.0 - shared_); }

  /// How many times larger than by points that err independently the variance of a motion by many of them is:
  /// neighbours share a part of their errors, which does not average out.
  double shared() const { return std::max(shared_, 1.0); }

 private:
  static constexpr double kUnknownRig = 4.0;  // measured on a dozen rigs: 1 to 19
  double corner_, aligned_, disparity_, scale_ = 1.0;
  double shared_ = kUnknownRig;
};

}  // namespace sdvo
