#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>

namespace sdvo {

/// Values in a row of a sampled patch: the widest square, of 15 px, rounded up to whole registers.
constexpr int kPatchStride = 16;

/// Samples the square of side 2 radius + 1 (at most 15 px) around a sub-pixel position, bilinearly, in rows of
/// kPatchStride values: those beyond the square are its neighbours on the right. `image` is CV_8U with a border of
/// `margin` px around the picture, to whose pixels (x, y) refers; such rows and one pixel more must lie inside of it.
/// `slant` shifts row j from the centre by -slant * j px.
void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius, float* patch);

/// A square patch of the left image that is compared with the right one, blind to a difference of brightness. It has
/// derivatives by disparity, by dv and by the slant (px of disparity per row). Images are CV_8U with a border of
/// `margin` px around the picture, to whose pixels positions refer.
class SlantedPatch {
 public:
  static constexpr int kRadius = 6, kSide = 2 * kRadius + 1;  ///< px
  static constexpr int kPixels = kSide * kSide;
  static constexpr int kCount = kSide * kPatchStride;
  using Values = std::array<float, kCount>;  ///< rows of the square; what is beyond it is zero

  /// The patch and its derivatives.
  struct Layers {
    Values grey, by_disparity, by_dv, by_slant;
  };

  SlantedPatch();

  /// Takes the patch around (x, y).
  void take(const cv::Mat& image, int margin, float x, float y);

  /// Products of the three derivatives with each other, without their means.
  const Eigen::Matrix3f& hessian() const { return hessian_; }

  /// Products of the derivatives with the difference between an image around (x, y), its rows shifted by the slant, and
  /// the patch.
  Eigen::Vector3f compare(const cv::Mat& image, int margin, float x, float y, float slant);

  /// Of the patch and what it was compared with last, both without their means.
  struct Similarity {
    float product, square_of_patch, square_of_other;
  };
  Similarity similarity();

 private:
  Values mask_{}, row_{};  ///< one within the square, zero beyond; rows from its centre
  Layers layers_{};
  Values difference_{};
  float grey_sum_ = 0.f;
  Eigen::Vector3f mean_;  ///< of the derivatives
  Eigen::Matrix3f hessian_;
};

}  // namespace sdvo
