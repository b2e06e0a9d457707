#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "integral_image.hpp"

namespace sdvo {

/// Binary Robust Independent Elementary Features (Calonder et al., ECCV 2010), 256 bits, at any real-valued size. Tests
/// are between smoothed points drawn from an isotropic Gaussian (their sampling G II), patch side and smoothing in
/// proportion to the key point size. At a size of 7 px the patch is 48 px wide and the smoothing box 9 px, as in their
/// implementation.
class Brief {
 public:
  static constexpr int kBits = 256;
  static constexpr int kBytes = kBits / 8;

  /// Distance from the centre, in px, that the tests reach for a key point size in px.
  static double reach(double size) { return size * kReachPerSize; }

  explicit Brief(const cv::Mat& image) : image_(image) {}

  /// Writes the kBytes of a key point of diameter `size`, all px; its reach must lie inside the image.
  void describe(double u, double v, double size, std::uint8_t* descriptor) const;

 private:
  static constexpr double kHalfPatch = 24.0, kHalfBox = 4.5, kStandardSize = 7.0;
  static constexpr double kReachPerSize = (kHalfPatch + kHalfBox) / kStandardSize;

  IntegralImage image_;
};

}  // namespace sdvo
