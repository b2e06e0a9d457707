#include <gtest/gtest.h>

#include <random>

#include "../../src/motion/noise.hpp"

namespace sdvo::test_noise {

TEST(Noise, GatesAreExceededByChanceAsOftenAsStated) {
  // Tails of chi-square in closed form: of one number, of two, of four and of six.
  const auto half = [](int numbers) { return 0.5 * noiseGate(numbers); };
  EXPECT_NEAR(std::erfc(std::sqrt(half(1))) / kTailProbability, 1.0, 0.01);
  EXPECT_NEAR(std::exp(-half(2)) / kTailProbability, 1.0, 0.01);
  EXPECT_NEAR(std::exp(-half(4)) * (1.0 + half(4)) / kTailProbability, 1.0, 0.01);
  EXPECT_NEAR(std::exp(-half(6)) * (1.0 + half(6) + half(6) * half(6) / 2.0) / kTailProbability, 1.0, 0.01);
}

TEST(Noise, FollowsTheResidualsSlowly) {
  Noise noise{NoiseOptions()};
  const double expected = std::sqrt((2.0 * 0.4 * 0.4 + 2.0 * 0.4 * 0.4 + 2.0 * 0.4 * 0.4 + 0.3 * 0.3) / 3.0);
  EXPECT_EQ(noise.scale(), 1.0);
  for (int pair = 0; pair < 100; ++pair) noise.learn(expected);
  EXPECT_NEAR(noise.scale(), 1.0, 1e-9) << "two positions in each direction, and a disparity on the right";
  noise.learn(1.5 * expected);
  EXPECT_LT(noise.scale(), 1.1) << "one pair says little";
  for (int pair = 0; pair < 100; ++pair) noise.learn(1.5 * expected);
  EXPECT_NEAR(noise.scale(), 1.5, 1e-3);
}

TEST(Noise, IsBounded) {
  Noise noise{NoiseOptions()};
  for (int pair = 0; pair < 1000; ++pair) noise.learn(100.0);
  EXPECT_EQ(noise.scale(), 2.0);
  for (int pair = 0; pair < 1000; ++pair) noise.learn(0.0);
  EXPECT_EQ(noise.scale(), 0.5);
}

/// Two positions of one corner, in (u_left, v_left, u_right): left and right share its error.
TEST(Noise, InliersAreWithinTheGate) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, std::sqrt(2.0) * NoiseOptions().corner);
  int beyond = 0;
  constexpr int kTrials = 1000000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const double u = normal(random), v = normal(random);
    beyond += std::sqrt(2.0 * u * u + v * v) > NoiseOptions().inlierGate();
  }
  EXPECT_GT(beyond, 0.5 * kTailProbability * kTrials);
  EXPECT_LT(beyond, 2.0 * kTailProbability * kTrials);
}

TEST(Noise, WhatItsPatchDoesNotConfirmIsAnywhereWithinTheGate) {
  std::mt19937 random(2);
  const double gate = NoiseOptions().inlierGate();
  std::uniform_real_distribution<double> uniform(-gate, gate);
  double square = 0.0;
  int within = 0;
  while (within < 20000) {
    const double u = uniform(random), v = uniform(random);
    if (std::sqrt(2.0 * (u * u + v * v)) > gate) continue;
    square += 0.5 * (u * u + v * v), ++within;
  }
  EXPECT_NEAR(NoiseOptions().unconfirmedCorner(), std::sqrt(square / within), 0.01);
}

TEST(Noise, WhatPointsErrAlikeIsLearntAndAtLeastWhatTheyErrByThemselves) {
  Noise noise{NoiseOptions()};
  EXPECT_GT(noise.shared(), 1.0) << "of a rig that nothing is known of";
  for (int pair = 0; pair < 200; ++pair) noise.learnShared(60.0);
  EXPECT_NEAR(noise.shared(), 10.0, 1e-6) << "chi-square of six is six on average";
  for (int pair = 0; pair < 200; ++pair) noise.learnShared(0.0);
  EXPECT_EQ(noise.shared(), 1.0);
}

TEST(Noise, APairIsAsNoisyAsItsResidualsBesideTheUsualOnes) {
  Noise noise{NoiseOptions()};
  EXPECT_EQ(noise.ofPair(5.0, 100), 1.0) << "of a rig that nothing is known of";
  for (int pair = 0; pair < 100; ++pair) noise.learnPair(1.0);
  EXPECT_NEAR(noise.ofPair(1.0, 100), 1.0, 1e-9);
  EXPECT_NEAR(noise.ofPair(4.0, 100000), 4.0, 1e-2);
  EXPECT_NEAR(noise.ofPair(4.0, kFewestMeasured), 2.5, 1e-9) << "few measurements are half of what is usual";
  EXPECT_EQ(noise.ofPair(4.0, 0), 1.0);
}

TEST(Noise, ImagesThatDoNotDifferMakeNoLaterPairNoisy) {
  Noise noise{NoiseOptions()};
  for (int pair = 0; pair < 100; ++pair) noise.learnPair(0.0);
  EXPECT_NEAR(noise.ofPair(0.1, 1000), 1.0, 1e-9);
}

TEST(Noise, MotionsAreOneWithinTheNoiseOfACorner) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const Noise noise{NoiseOptions()};
  double square = 0.0;
  constexpr int kTrials = 20000;
  for (int trial = 0; trial < kTrials; ++trial)
    for (const double disparity : {0.0, 0.0, 0.3})
      square += std::pow(0.4 * normal(random) - 0.4 * normal(random) + disparity * normal(random), 2) / kTrials;
  EXPECT_NEAR(noise.sameMotion(), std::sqrt(square), 0.01);
}

}  // namespace sdvo::test_noise
