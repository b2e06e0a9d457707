#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/core.hpp>
#include <vector>

#include "../../src/front_end/block_differences.hpp"
#include "../kernels.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_block_differences {

cv::Mat noise(unsigned seed, bool extreme) {
  const cv::Mat image = synthetic::noise({131, 40}, seed);
  return extreme ? cv::Mat(image > 100) : image;
}

template <int kRows>
void expectSums(const cv::Mat& left, const cv::Mat& right, int count = 77) {
  constexpr int kX = 90, kY = 17;
  std::vector<unsigned> found(static_cast<std::size_t>(count));
  blockDifferences<kRows>(left.ptr(kY) + kX, right.ptr(kY) + kX, static_cast<std::ptrdiff_t>(left.step[0]), count,
                          found.data());
  for (int k = 0; k < count; ++k) {
    unsigned sum = 0;
    for (int y = kY - kRows; y <= kY + kRows; ++y)
      for (int x = kX - kBlockWidth / 2; x < kX + kBlockWidth / 2; ++x)
        sum += static_cast<unsigned>(std::abs(left.at<std::uint8_t>(y, x) - right.at<std::uint8_t>(y, x - k)));
    ASSERT_EQ(found[static_cast<std::size_t>(k)], sum) << kRows << " rows, block " << k;
  }
}

TEST(BlockDifferences, AreSumsOverWholeBlocks) {
  withEveryKernel([] {
    for (const bool extreme : {false, true}) {
      expectSums<4>(noise(3, extreme), noise(5, extreme));
      expectSums<5>(noise(3, extreme), noise(5, extreme));
    }
    for (const int count : {1, 15, 16, 17, 32, 33}) expectSums<4>(noise(3, false), noise(5, false), count);
    expectSums<5>(cv::Mat(40, 131, CV_8U, cv::Scalar(0)), cv::Mat(40, 131, CV_8U, cv::Scalar(255)));
  });
}

}  // namespace sdvo::test_block_differences
