#include <gtest/gtest.h>

#include <bitset>
#include <vector>

#include "../../src/matching/hamming_distances.hpp"
#include "../kernels.hpp"

namespace sdvo::test_hamming_distances {

TEST(HammingDistances, CountTheBitsThatDiffer) {
  const std::vector<int> candidates = {7, 0, 3, 3};
  for (const int bytes : {1, 8, 13, 32, 63, 64, 65, 100, 128, 200}) {
    cv::Mat rows(9, bytes, CV_8U);
    cv::RNG(static_cast<std::uint64_t>(bytes)).fill(rows, cv::RNG::UNIFORM, 0, 256);
    const cv::Mat row = rows.row(8), others = rows.rowRange(0, 8);
    withEveryKernel([&] {
      std::vector<float> distances(candidates.size());
      hammingDistances(row.ptr(), others, candidates.data(), candidates.size(), distances.data());
      for (std::size_t k = 0; k < candidates.size(); ++k) {
        std::size_t bits = 0;
        for (int byte = 0; byte < bytes; ++byte)
          bits += std::bitset<8>(row.at<std::uint8_t>(byte) ^ others.at<std::uint8_t>(candidates[k], byte)).count();
        EXPECT_EQ(distances[k], static_cast<float>(bits)) << bytes << " bytes, row " << candidates[k];
      }
    });
  }
}

}  // namespace sdvo::test_hamming_distances
