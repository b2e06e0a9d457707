#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

namespace sdvo {

/// Half side of the largest patch, px.
constexpr int kLargestPatchRadius = 32;

/// Values that a row of a sampled patch takes: the square's side rounded up, so that whole registers can be worked on.
constexpr int patchStride(int radius) {
  return (2 * radius + 4) / 4 * 4;
}

/// Samples the square of side 2 radius + 1 around a sub-pixel position, bilinearly, row by row of `columns` values:
/// those beyond the square are its neighbours on the right. `image` is CV_8U with a border of `margin` px around the
/// picture, to whose pixels (x, y) refers; such rows and one pixel more must lie inside of it. `slant` shifts row j
/// from the centre by -slant * j px.
void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius, int columns,
                 float* patch);

/// A square patch of the left image that is compared with the right one, blind to a difference of brightness. It has
/// derivatives by disparity, by dv and by the slant (px of disparity per row). Images are CV_8U with a border of
/// `margin` px around the picture, to whose pixels positions refer.
class SlantedPatch {
 public:
  /// `radius`: half side, px.
  explicit SlantedPatch(int radius);

  /// Takes the patch around (x, y).
  void take(const cv::Mat& image, int margin, float x, float y);

  int pixels() const { return side() * side(); }
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
  int side() const { return 2 * radius_ + 1; }

  int radius_, stride_, count_;
  std::vector<float> mask_, row_;  ///< one within the square, zero beyond; rows from its centre
  std::vector<float> wide_;        ///< the square with one pixel more on each side
  std::vector<float> grey_, by_disparity_, by_dv_, by_slant_, difference_;
  float grey_sum_ = 0.f;
  Eigen::Vector3f mean_;  ///< of the derivatives
  Eigen::Matrix3f hessian_;
};

}  // namespace sdvo
