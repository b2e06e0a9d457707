#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "../../src/front_end/slanted_patch.hpp"
#include "../kernels.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo {

namespace test_patch_sampling {

constexpr int kMargin = 16, kWidth = 30, kHeight = 20;

/// Bilinear interpolation between the four pixels around a position of the picture.
double interpolated(const cv::Mat& image, double x, double y) {
  const double column = std::floor(x), row = std::floor(y), a = x - column, b = y - row;
  const auto pixel = [&](int dx, int dy) {
    return static_cast<double>(
        image.at<std::uint8_t>(static_cast<int>(row) + dy + kMargin, static_cast<int>(column) + dx + kMargin));
  };
  return (1.0 - a) * (1.0 - b) * pixel(0, 0) + a * (1.0 - b) * pixel(1, 0) + (1.0 - a) * b * pixel(0, 1) +
         a * b * pixel(1, 1);
}

/// Rows go on beyond the square.
void expectSampled(float x, float y, float slant, int radius) {
  const int rows = 2 * radius + 1, columns = kPatchStride;
  const cv::Mat image = synthetic::noise({kWidth + 2 * kMargin, kHeight + 2 * kMargin}, 3);
  constexpr float kUntouched = -1e6f;
  std::vector<float> patch(static_cast<std::size_t>(rows * columns + 1), kUntouched);
  samplePatch(image, kMargin, x, y, slant, radius, patch.data());
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      EXPECT_NEAR(patch[static_cast<std::size_t>(j * columns + i)],
                  interpolated(image, x - radius + i - slant * (j - radius), y - radius + j), 2e-3)
          << "at (" << x << ", " << y << "), slant " << slant << ", row " << j << ", column " << i;
  EXPECT_EQ(patch.back(), kUntouched);
}

TEST(SamplePatch, InterpolatesBetweenPixelsOnRowsShiftedByTheSlant) {
  expectSampled(10.f, 8.f, 0.f, 2);
  expectSampled(0.f, 0.f, 0.f, 3);  // reaches into the margin
  expectSampled(10.25f, 8.f, 0.f, 2);
  expectSampled(10.f, 8.75f, 0.f, 2);
  expectSampled(-0.4f, -0.7f, 0.f, 2);
  expectSampled(12.f, 9.f, 1.f, 2);  // by whole pixels
  expectSampled(12.3f, 9.6f, 0.3f, 3);
  expectSampled(12.3f, 9.6f, -0.7f, 3);
}

}  // namespace test_patch_sampling

namespace test_slanted_patch {

constexpr int kMargin = 40;

const cv::Size kSize(160, 130);

/// What a patch says of an image, from its definition.
struct Expected {
  Eigen::Matrix3d hessian;
  Eigen::Vector3d products;
  double product, square_of_patch, square_of_other;
};

Expected define(const cv::Mat& left, const cv::Mat& right, float x, float y, float slant) {
  constexpr int radius = SlantedPatch::kRadius, side = SlantedPatch::kSide, n = SlantedPatch::kPixels;
  std::array<float, (side + 2) * kPatchStride> wide, other;
  samplePatch(left, kMargin, x, y, 0.f, radius + 1, wide.data());
  samplePatch(right, kMargin, x, y, slant, radius, other.data());
  Eigen::VectorXd grey(n), seen(n);
  Eigen::MatrixXd by(n, 3);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const auto at = [&](int dx, int dy) {
        return static_cast<double>(wide[static_cast<std::size_t>((j + 1 + dy) * kPatchStride + i + 1 + dx)]);
      };
      const int k = j * side + i;
      grey[k] = at(0, 0);
      seen[k] = other[static_cast<std::size_t>(j * kPatchStride + i)];
      by.row(k) << 0.5 * (at(1, 0) - at(-1, 0)), 0.5 * (at(0, -1) - at(0, 1)),
          0.5 * (at(1, 0) - at(-1, 0)) * (j - radius);
    }
  grey.array() -= grey.mean();
  by.rowwise() -= by.colwise().mean().eval();
  Expected expected;
  expected.hessian = by.transpose() * by;
  expected.products = by.transpose() * (seen - grey);
  seen.array() -= seen.mean();
  expected.product = grey.dot(seen), expected.square_of_patch = grey.squaredNorm();
  expected.square_of_other = seen.squaredNorm();
  return expected;
}

TEST(SlantedPatch, SaysWhatItsDefinitionSays) {
  const cv::Mat left = synthetic::noise(kSize, 3), right = synthetic::noise(kSize, 5);
  cv::RNG random(7);
  for (int trial = 0; trial < 20; ++trial) {
    SlantedPatch patch;
    const float x = random.uniform(5.f, 70.f), y = random.uniform(0.f, 49.f), slant = random.uniform(-0.8f, 0.8f);
    patch.take(left, kMargin, x, y);
    const Expected expected = define(left, right, x, y, slant);
    const double tolerance = 1e-4 * expected.hessian.trace();
    EXPECT_LT((patch.hessian().cast<double>() - expected.hessian).cwiseAbs().maxCoeff(), tolerance);
    const Eigen::Vector3f products = patch.compare(right, kMargin, x, y, slant);
    EXPECT_LT((products.cast<double>() - expected.products).cwiseAbs().maxCoeff(), tolerance);
    const auto [product, square, other_square] = patch.similarity();
    EXPECT_NEAR(product, expected.product, 1e-4 * expected.square_of_patch);
    EXPECT_NEAR(square, expected.square_of_patch, 1e-4 * expected.square_of_patch);
    EXPECT_NEAR(other_square, expected.square_of_other, 1e-4 * expected.square_of_patch);
  }
}

std::vector<float> everythingOf(const cv::Mat& left, const cv::Mat& right, float x, float y, float slant) {
  SlantedPatch patch;
  patch.take(left, kMargin, x, y);
  std::vector<float> all(patch.hessian().data(), patch.hessian().data() + 9);
  const Eigen::Vector3f products = patch.compare(right, kMargin, x - 3.f, y + 0.5f, slant);
  all.insert(all.end(), products.data(), products.data() + 3);
  const auto [product, square, other_square] = patch.similarity();
  all.insert(all.end(), {product, square, other_square});
  return all;
}

TEST(SlantedPatch, IsTheSameToTheBitWithAndWithoutVectors) {
  const cv::Mat left = synthetic::noise(kSize, 7), right = synthetic::noise(kSize, 9);
  cv::RNG random(11);
  for (int trial = 0; trial < 200; ++trial) {
    const float x = random.uniform(5.f, 70.f), y = random.uniform(0.f, 49.f), slant = random.uniform(-0.8f, 0.8f);
    ofEveryKernel([&] { return everythingOf(left, right, x, y, slant); });
  }
}

}  // namespace test_slanted_patch

}  // namespace sdvo
