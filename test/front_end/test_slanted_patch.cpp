#include <gtest/gtest.h>

#include <Eigen/Core>
#include <vector>

#include "stereo_descriptor_vo/common/processor.hpp"
#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"
#include "stereo_descriptor_vo/front_end/slanted_patch.hpp"

namespace sdvo {
namespace test_slanted_patch {

constexpr int kMargin = 40;

cv::Mat noise(unsigned seed) {
  cv::Mat image(130, 160, CV_8U);
  cv::RNG(seed).fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

/// What a patch says of an image, from its definition.
struct Expected {
  Eigen::Matrix3d hessian;
  Eigen::Vector3d products;
  double product, square_of_patch, square_of_other;
};

Expected define(const cv::Mat& left, const cv::Mat& right, int radius, float x, float y, float slant) {
  const int side = 2 * radius + 1, wide_side = side + 2, n = side * side;
  std::vector<float> wide(static_cast<std::size_t>(wide_side * wide_side)), other(static_cast<std::size_t>(n));
  samplePatch(left, kMargin, x, y, 0.f, radius + 1, wide_side, wide.data());
  samplePatch(right, kMargin, x, y, slant, radius, side, other.data());
  Eigen::VectorXd grey(n), seen(n);
  Eigen::MatrixXd by(n, 3);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const auto at = [&](int dx, int dy) {
        return static_cast<double>(wide[static_cast<std::size_t>((j + 1 + dy) * wide_side + i + 1 + dx)]);
      };
      const int k = j * side + i;
      grey[k] = at(0, 0);
      seen[k] = other[static_cast<std::size_t>(k)];
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
  const cv::Mat left = noise(3), right = noise(5);
  for (int radius = 3; radius <= 20; ++radius) {
    SlantedPatch patch(radius);
    const float x = 30.3f, y = 20.8f, slant = 0.4f;
    patch.take(left, kMargin, x, y);
    const Expected expected = define(left, right, radius, x, y, slant);
    const double tolerance = 1e-4 * expected.hessian.trace();
    EXPECT_LT((patch.hessian().cast<double>() - expected.hessian).cwiseAbs().maxCoeff(), tolerance) << radius;
    const Eigen::Vector3f products = patch.compare(right, kMargin, x, y, slant);
    EXPECT_LT((products.cast<double>() - expected.products).cwiseAbs().maxCoeff(), tolerance) << radius;
    const auto [product, square, other_square] = patch.similarity();
    EXPECT_NEAR(product, expected.product, 1e-4 * expected.square_of_patch) << radius;
    EXPECT_NEAR(square, expected.square_of_patch, 1e-4 * expected.square_of_patch) << radius;
    EXPECT_NEAR(other_square, expected.square_of_other, 1e-4 * expected.square_of_patch) << radius;
  }
}

std::vector<float> everythingOf(const cv::Mat& left, const cv::Mat& right, int radius, float x, float y, float slant) {
  SlantedPatch patch(radius);
  patch.take(left, kMargin, x, y);
  std::vector<float> all(patch.hessian().data(), patch.hessian().data() + 9);
  const Eigen::Vector3f products = patch.compare(right, kMargin, x - 3.f, y + 0.5f, slant);
  all.insert(all.end(), products.data(), products.data() + 3);
  const auto [product, square, other_square] = patch.similarity();
  all.insert(all.end(), {product, square, other_square});
  return all;
}

TEST(SlantedPatch, IsTheSameToTheBitWithAndWithoutVectors) {
  if (!usesVectorKernels()) GTEST_SKIP() << "this processor has neither AVX2 nor NEON";
  const cv::Mat left = noise(7), right = noise(9);
  cv::RNG random(11);
  for (int trial = 0; trial < 200; ++trial) {
    const int radius = 3 + trial % 18;
    const float x = random.uniform(5.f, 70.f), y = random.uniform(0.f, 49.f), slant = random.uniform(-0.8f, 0.8f);
    const std::vector<float> fast = everythingOf(left, right, radius, x, y, slant);
    allowVectorKernels(false);
    const std::vector<float> plain = everythingOf(left, right, radius, x, y, slant);
    allowVectorKernels(true);
    ASSERT_EQ(fast, plain) << "radius " << radius;
  }
}

}  // namespace test_slanted_patch
}  // namespace sdvo
