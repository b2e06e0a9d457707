#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "../../src/matching/patch_samples.hpp"

namespace sdvo::test_patch_samples {

/// A patch of noise.
struct Noise {
  std::vector<std::uint8_t> samples;
  PaddedPatch patch;

  Noise(int side, std::mt19937& random) : samples(static_cast<std::size_t>(side * side)) {
    for (std::uint8_t& sample : samples) sample = static_cast<std::uint8_t>(random());
    patch.take({samples.data(), side, 1.f});
  }
};

/// The value at one place.
float valueAt(const PaddedPatch& patch, const Eigen::Vector2f& place) {
  Samples values;
  EXPECT_TRUE(SampleSquare().sample(patch, place, Eigen::Matrix2f::Zero(), values));
  return values[0];
}

TEST(PatchSamples, AreInterpolatedOnTheGrid) {
  constexpr int kSide = 13;
  std::mt19937 random(6);
  std::uniform_real_distribution<float> uniform(-1.f, 1.f);
  const Noise noise(kSide, random);
  const SampleSquare square;
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Vector2f centre(uniform(random), uniform(random));
    Eigen::Matrix2f grid = Eigen::Matrix2f::Identity();
    for (int k = 0; k < 4; ++k) grid(k) += 0.3f * uniform(random);
    Samples values;
    if (!square.sample(noise.patch, centre, grid, values)) continue;
    for (int k = 0; k < square.pixels(); ++k) {
      const Eigen::Vector2f offset(k % square.side() - kAlignedRadius, k / square.side() - kAlignedRadius);
      const Eigen::Vector2f at = grid * offset + centre + Eigen::Vector2f::Constant(0.5f * (kSide - 1));
      const int x = std::min(static_cast<int>(at.x()), kSide - 2), y = std::min(static_cast<int>(at.y()), kSide - 2);
      const auto sample = [&](int dx, int dy) {
        return static_cast<float>(noise.samples[static_cast<std::size_t>((y + dy) * kSide + x + dx)]);
      };
      const float a = at.x() - static_cast<float>(x), b = at.y() - static_cast<float>(y);
      const float expected =
          (1.f - b) * ((1.f - a) * sample(0, 0) + a * sample(1, 0)) + b * ((1.f - a) * sample(0, 1) + a * sample(1, 1));
      ASSERT_NEAR(values[static_cast<std::size_t>(k)], expected, 2e-3f) << k;
    }
    for (int k = square.pixels(); k < square.count(); ++k) ASSERT_EQ(values[static_cast<std::size_t>(k)], 0.f);
  }
}

TEST(PatchSamples, UprightOnesAreThoseOfAnyGrid) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1.f, 1.f);
  constexpr int kRadius = kAlignedRadius;
  for (const int side : {11, 13, 16}) {
    const Noise noise(side, random);
    const float free = 0.5f * static_cast<float>(side - 1) - static_cast<float>(kRadius + 1);
    const SampleSquare square;
    std::vector<Eigen::Vector2f> centres = {{0.f, 0.f}, {free, free}, {-free, -free}};
    for (int k = 0; k < 20; ++k) centres.emplace_back(free * uniform(random), free * uniform(random));
    for (const Eigen::Vector2f& centre : centres) {
      Samples expected, values, by_x, by_y;
      for (Samples* of : {&expected, &values, &by_x, &by_y}) of->fill(77.f);
      ASSERT_TRUE(square.sample(noise.patch, centre, Eigen::Matrix2f::Identity(), expected));
      ASSERT_TRUE(square.sampleUpright(noise.patch, centre, values, by_x, by_y));
      for (int k = 0; k < square.count(); ++k) ASSERT_EQ(values[k], expected[k]) << side;
      for (int k = square.pixels(); k < square.count(); ++k) ASSERT_TRUE(by_x[k] == 0.f && by_y[k] == 0.f);
      for (int j = 0; j < square.side(); ++j)
        for (int i = 0; i < square.side(); ++i) {
          const Eigen::Vector2f here = centre + Eigen::Vector2f(i - kRadius, j - kRadius);
          const auto around = [&](float x, float y) { return valueAt(noise.patch, here + Eigen::Vector2f(x, y)); };
          const std::size_t k = static_cast<std::size_t>(j * square.side() + i);
          // Coordinates that are added up in another order: 255 times a few 1e-6.
          ASSERT_NEAR(by_x[k], 0.5f * (around(1.f, 0.f) - around(-1.f, 0.f)), 1e-3f) << side;
          ASSERT_NEAR(by_y[k], 0.5f * (around(0.f, 1.f) - around(0.f, -1.f)), 1e-3f) << side;
        }
    }
  }
}

TEST(PatchSamples, NeighboursMayNotLieOutside) {
  std::mt19937 random(4);
  const Noise noise(13, random);
  Samples values, by_x, by_y;
  const SampleSquare square;
  EXPECT_TRUE(square.sampleUpright(noise.patch, {1.f, -1.f}, values, by_x, by_y));
  for (const Eigen::Vector2f& centre : {Eigen::Vector2f(1.01f, 0.f), Eigen::Vector2f(0.f, -1.01f)})
    EXPECT_FALSE(square.sampleUpright(noise.patch, centre, values, by_x, by_y));
}

TEST(PatchSamples, NoCornerOfTheSquareMayLieOutside) {
  std::mt19937 random(4);
  const Noise noise(13, random);
  Samples values;
  const SampleSquare square;
  const Eigen::Matrix2f identity = Eigen::Matrix2f::Identity();
  Eigen::Matrix2f turned;
  turned << 0.8f, -0.6f, 0.6f, 0.8f;
  EXPECT_TRUE(square.sample(noise.patch, {2.f, -2.f}, identity, values));
  EXPECT_FALSE(square.sample(noise.patch, {2.01f, 0.f}, identity, values));
  EXPECT_FALSE(square.sample(noise.patch, {0.f, -2.01f}, identity, values));
  EXPECT_TRUE(square.sample(noise.patch, {0.f, 0.f}, 1.5f * identity, values));
  EXPECT_FALSE(square.sample(noise.patch, {0.f, 0.f}, 1.51f * identity, values));
  EXPECT_TRUE(square.sample(noise.patch, {0.3f, 0.3f}, turned, values));
  EXPECT_FALSE(square.sample(noise.patch, {0.5f, 0.f}, turned, values));
}

}  // namespace sdvo::test_patch_samples
