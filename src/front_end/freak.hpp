#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "base_descriptor.hpp"
#include "integral_image.hpp"

namespace sdvo {

/// Fast Retina Keypoint (Alahi, Ortiz, Vandergheynst, CVPR 2012) at any real-valued size.
///
/// 43 receptive fields on eight rings, denser and finer towards the centre as in the retina; each bit compares the mean
/// intensity of two fields. A field is a box filter whose position and side are real numbers: the integral image is
/// interpolated, so the descriptor changes continuously with the size instead of in steps. 512 bits, 64 bytes a row.
/// Geometry as published: the pattern's outermost reach is 22 px at a key point size of 7 px and grows with the size.
class Freak {
 public:
  static constexpr int kFields = 43;
  static constexpr int kBits = 512;
  static constexpr int kBytes = kBits / 8;
  using FieldPair = std::pair<std::uint8_t, std::uint8_t>;

  /// One receptive field in units of the pattern's radius.
  struct Field {
    float x, y;
    float sigma;  ///< half side of the box
  };

  /// The published retina pattern, outermost ring first.
  static const std::array<Field, kFields>& pattern();
  /// The 512 pairs in use, learnt by `learn freak-pairs`.
  static const std::array<FieldPair, kBits>& pairs();

  /// Distance from the centre, in px, that the pattern reaches for a key point size in px.
  static double reach(double size) { return size * kReachPerSize; }
  /// Whether the whole neighbourhood of the key point lies inside the image, whatever its angle.
  static bool fits(const ViewKeypoint& keypoint, cv::Size image_size);

  /// `image` must be CV_8U; only its integral is kept.
  explicit Freak(const cv::Mat& image);

  /// Mean intensities of the receptive fields; the key point must fit.
  std::array<float, kFields> intensities(const ViewKeypoint& keypoint) const;
  /// Writes the kBytes of each key point's row; key points must fit.
  void describe(const std::vector<ViewKeypoint>& keypoints, const std::vector<std::uint8_t*>& rows) const;
  /// Orientation in [0, 2 pi) from the intensity gradient over symmetric field pairs (section 4.4 there).
  float orientation(ViewKeypoint keypoint) const;

 private:
  static constexpr double kReachPerSize = 22.0 / 7.0;

  IntegralImage image_;
};

}  // namespace sdvo
