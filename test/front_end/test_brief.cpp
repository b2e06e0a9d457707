#include <gtest/gtest.h>

#include <bitset>

#include "../../src/front_end/brief.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_brief {

using Row = std::array<std::uint8_t, Brief::kBytes>;

Row describe(const cv::Mat& image, double u, double v, double size) {
  Row row{};
  Brief(image).describe(u, v, size, row.data());
  return row;
}

int setBits(const Row& row) {
  int count = 0;
  for (const std::uint8_t byte : row) count += static_cast<int>(std::bitset<8>(byte).count());
  return count;
}

int differing(const Row& a, const Row& b) {
  Row difference{};
  for (std::size_t i = 0; i < a.size(); ++i) difference[i] = static_cast<std::uint8_t>(a[i] ^ b[i]);
  return setBits(difference);
}

const cv::Size kSize(301, 301);

/// On a ramp, a test says which of its two points lies further right. Points drawn evenly around the centre make that
/// so for half of them, 128 with a standard deviation of 8.
TEST(Brief, TestsAreSpreadEvenlyAroundTheCentre) {
  for (const bool vertical : {false, true}) {
    const cv::Mat ramp = synthetic::render(kSize, [&](double u, double v) { return 0.8 * (vertical ? v : u); });
    EXPECT_NEAR(setBits(describe(ramp, 150.0, 150.0, 7.0)), 128, 4 * 8);
  }
}

TEST(Brief, InvertsWithTheImage) {
  const synthetic::Texture texture(4, 8.0, 60.0);
  const cv::Mat image = synthetic::render(kSize, texture);
  cv::Mat inverse;
  cv::subtract(cv::Scalar(255), image, inverse);
  // Only exact ties keep their bit.
  EXPECT_GE(differing(describe(image, 150.3, 149.6, 7.0), describe(inverse, 150.3, 149.6, 7.0)), Brief::kBits - 2);
}

/// Nothing is brighter than anything else on an even surface, at whatever fraction of a pixel the boxes end.
TEST(Brief, SetsNoBitOnAnEvenImage) {
  for (const int grey : {0, 1, 77, 200, 255}) {
    const cv::Mat even(kSize, CV_8U, cv::Scalar(grey));
    for (const double size : {5.3, 7.0, 11.9, 20.0})
      EXPECT_EQ(setBits(describe(even, 150.3, 149.6, size)), 0) << "grey level " << grey << ", size " << size;
  }
}

TEST(Brief, WritesEveryBitOfTheRow) {
  const synthetic::Texture texture(4, 8.0, 60.0);
  const cv::Mat image = synthetic::render(kSize, texture);
  Row used;
  used.fill(0xff);
  Brief(image).describe(150.0, 150.0, 7.0, used.data());
  EXPECT_EQ(used, describe(image, 150.0, 150.0, 7.0));
}

/// A standard deviation of a fifth of the patch's side, 9.6 px at a size of 7 px: four coordinates within that are the
/// lot of one test in five, and the other tests see what lies beyond.
TEST(Brief, PointsScatterAsPublished) {
  const synthetic::Texture texture(4, 8.0, 60.0), other(5, 8.0, 60.0);
  const int inside = 14;  // 9.6 px and half a box
  const auto within = [&](double x) { return std::abs(x - 150.0) <= inside; };
  const cv::Mat image = synthetic::render(kSize, texture);
  const cv::Mat changed = synthetic::render(
      kSize, [&](double u, double v) { return within(u) && within(v) ? texture.at(u, v) : other.at(u, v); });
  const int bits = differing(describe(image, 150.0, 150.0, 7.0), describe(changed, 150.0, 150.0, 7.0));
  EXPECT_GT(bits, 25);   // four in five would change with even chances, but what is near looks alike
  EXPECT_LT(bits, 140);  // one in five does not
}

TEST(Brief, SeesItsReachAndNothingBeyond) {
  const synthetic::Texture texture(9, 8.0, 60.0);
  const cv::Mat image = synthetic::render(kSize, texture);
  const double size = 14.0;
  // As published: a patch of 48 px and a smoothing box of 9 px belong to a size of 7 px.
  EXPECT_NEAR(Brief::reach(size), (24.0 + 4.5) * 2.0, 1e-12);
  const int inside = static_cast<int>(Brief::reach(size)) + 1;
  cv::Mat beyond(kSize, CV_8U, cv::Scalar(255));
  const cv::Rect patch(150 - inside, 150 - inside, 2 * inside + 1, 2 * inside + 1);
  image(patch).copyTo(beyond(patch));
  EXPECT_EQ(describe(image, 150.0, 150.0, size), describe(beyond, 150.0, 150.0, size));
  cv::Mat centre(kSize, CV_8U, cv::Scalar(255));
  const cv::Rect half(150 - inside / 2, 150 - inside / 2, inside, inside);
  image(half).copyTo(centre(half));
  EXPECT_NE(describe(image, 150.0, 150.0, size), describe(centre, 150.0, 150.0, size));
}

}  // namespace sdvo::test_brief
