#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "../../src/matching/patch_alignment.hpp"
#include "../kernels.hpp"

namespace sdvo::test_patch_alignment {

constexpr int kSide = 13;
constexpr double kNoise = 2.0;  // grey levels

/// What a camera sees: a grey level for each position in px.
using Scene = std::function<double(double, double)>;

/// A patch cut around `centre`, with noise and rounded to grey levels.
std::vector<std::uint8_t> cut(const Scene& scene, const Eigen::Vector2d& centre, double spacing, std::mt19937& random,
                              double noise = kNoise) {
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<std::uint8_t> samples;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const double x = centre.x() + spacing * (i - kSide / 2), y = centre.y() + spacing * (j - kSide / 2);
      const double grey = scene(x, y) + noise * normal(random);
      samples.push_back(static_cast<std::uint8_t>(std::clamp(grey + 0.5, 0.0, 255.0)));
    }
  return samples;
}

/// Around the origin, in steps of a pixel.
std::vector<std::uint8_t> cut(const Scene& scene, std::mt19937& random, double noise = kNoise) {
  return cut(scene, Eigen::Vector2d::Zero(), 1.0, random, noise);
}

Patch patchOf(const std::vector<std::uint8_t>& samples, double spacing = 1.0) {
  return {samples.data(), kSide, static_cast<float>(spacing)};
}

std::optional<PatchShift> align(const std::vector<std::uint8_t>& reference, const std::vector<std::uint8_t>& current,
                                const NoiseOptions& noise = {}, const Eigen::Vector2f& centre = Eigen::Vector2f::Zero(),
                                float ratio = 1.f, double spacing = 1.0) {
  return alignPatch(noise, patchOf(reference), centre, patchOf(current, spacing), ratio * Eigen::Matrix2f::Identity());
}

/// Texture with structure of 5 px and more.
Scene texture(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> phase(0.0, 2.0 * M_PI), wave(5.0, 25.0);
  struct Sine {
    double x, y, phase;
  };
  std::vector<Sine> sines;
  for (int k = 0; k < 12; ++k) {
    const double direction = phase(random), frequency = 2.0 * M_PI / wave(random);
    sines.push_back({frequency * std::cos(direction), frequency * std::sin(direction), phase(random)});
  }
  return [sines](double x, double y) {
    double sum = 0.0;
    for (const Sine& s : sines) sum += std::sin(s.x * x + s.y * y + s.phase);
    return 120.0 + 20.0 * sum;
  };
}

/// The reference scene as a camera sees it for which p in it lies at warp * p + shift.
Scene moved(const Scene& scene, const Eigen::Matrix2d& warp, const Eigen::Vector2d& shift) {
  const Eigen::Matrix2d back = warp.inverse();
  return [=](double x, double y) {
    const Eigen::Vector2d p = back * (Eigen::Vector2d(x, y) - shift);
    return scene(p.x(), p.y());
  };
}

Eigen::Matrix2d scaled(double ratio) {
  return ratio * Eigen::Matrix2d::Identity();
}

struct Trial {
  int found = 0, tried = 0;
  std::vector<double> errors;      ///< px, per coordinate
  std::vector<double> normalised;  ///< the same by the sigma that was told

  double median() {
    std::vector<double> sizes;
    for (const double e : errors) sizes.push_back(std::abs(e));
    std::nth_element(sizes.begin(), sizes.begin() + sizes.size() / 2, sizes.end());
    return sizes[sizes.size() / 2];
  }
  double normalisedRms() const {
    double sum = 0.0;
    for (const double e : normalised) sum += e * e;
    return std::sqrt(sum / static_cast<double>(normalised.size()));
  }
};

/// Shifts of up to a pixel under a true warp and the one that the alignment is told.
Trial tryShifts(const Eigen::Matrix2d& truth, const Eigen::Matrix2d& told, double spacing = 1.0,
                const NoiseOptions& noise = {}) {
  Trial trial;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-0.8, 0.8);
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Scene scene = texture(seed);
    const Eigen::Vector2d shift(uniform(random), uniform(random));
    const auto reference = cut(scene, Eigen::Vector2d::Zero(), spacing, random);
    const auto current = cut(moved(scene, truth, shift), Eigen::Vector2d::Zero(), spacing, random);
    const auto found = alignPatch(noise, patchOf(reference, spacing), Eigen::Vector2f::Zero(),
                                  patchOf(current, spacing), told.cast<float>());
    ++trial.tried;
    if (!found) continue;
    ++trial.found;
    for (int axis = 0; axis < 2; ++axis) {
      trial.errors.push_back(found->shift[axis] - shift[axis]);
      trial.normalised.push_back(trial.errors.back() / found->sigma);
    }
  }
  return trial;
}

TEST(PatchAlignment, APatchMustHoldTheSquareAndItsDerivatives) {
  EXPECT_TRUE(canAlign(11));
  EXPECT_FALSE(canAlign(10));
}

TEST(PatchAlignment, FindsTheShiftAtEveryScaleRatioThatItIsTold) {
  for (const double ratio : {0.7, 0.85, 1.0, 1.15}) {
    Trial trial = tryShifts(scaled(ratio), scaled(ratio));
    EXPECT_GT(trial.found, 190) << ratio;
    EXPECT_LT(trial.median(), 0.05) << ratio;
  }
  // At 1.4 the warped square fills the patch: what is shifted by more than 0.4 px leaves it.
  Trial largest = tryShifts(scaled(1.4), scaled(1.4));
  EXPECT_GT(largest.found, 30);
  EXPECT_LT(largest.median(), 0.05);
}

TEST(PatchAlignment, FindsTheShiftUnderOtherWarpsAndSpacings) {
  // A vehicle's step: the ground's rows spread by 1.25, its columns by 1.15, and rows shear.
  Eigen::Matrix2d ground;
  ground << 1.15, 0.05, 0.0, 1.25;
  const Eigen::Matrix2d roll = Eigen::Rotation2Dd(0.3).toRotationMatrix();
  struct {
    const char* what;
    Eigen::Matrix2d truth, told;
    double spacing;
    int least;
    double tolerance;  // px
  } const cases[] = {{"ground, of which the ratio of the depths is told", ground, scaled(1.15), 1.0, 150, 0.15},
                     {"a rolled view", roll, roll, 1.0, 150, 0.05},
                     {"shifts are in pixels whatever the spacing", scaled(1.0), scaled(1.0), 2.0, 190, 0.06}};
  for (const auto& c : cases) {
    Trial trial = tryShifts(c.truth, c.told, c.spacing);
    EXPECT_GT(trial.found, c.least) << c.what;
    EXPECT_LT(trial.median(), c.tolerance) << c.what;
  }
}

TEST(PatchAlignment, ErrorsAreAsLargeAsToldBySigmaAtEachScale) {
  for (const double ratio : {0.67, 0.85, 1.0, 1.2}) {
    const Trial trial = tryShifts(scaled(ratio), scaled(ratio));
    EXPECT_GT(trial.found, 100) << ratio;
    EXPECT_NEAR(trial.normalisedRms(), 0.95, 0.15) << ratio;
  }
}

TEST(PatchAlignment, ThePointMayLieBesideTheReferencesMiddle) {
  std::mt19937 random(5);
  const Scene scene = texture(4);
  const Eigen::Vector2d centre(1.0, -0.75), shift(0.3, 0.2);
  const auto reference = cut(scene, random, 0.0);
  const auto current = cut(moved(scene, scaled(1.0), shift - centre), random, 0.0);
  const auto found = align(reference, current, {}, centre.cast<float>());
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->shift.x(), 0.3, 0.03);
  EXPECT_NEAR(found->shift.y(), 0.2, 0.03);
}

TEST(PatchAlignment, BlindToBrightnessAndContrast) {
  std::mt19937 random(5);
  const Scene scene = texture(9);
  const Scene darker = [&](double x, double y) { return 0.6 * scene(x - 0.5, y + 0.25) - 20.0; };
  const auto reference = cut(scene, random, 0.0);
  const auto found = align(reference, cut(darker, random, 0.0));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->shift.x(), 0.5, 0.08);
  EXPECT_NEAR(found->shift.y(), -0.25, 0.08);
  EXPECT_GT(found->correlation, 0.99f);
}

TEST(PatchAlignment, RefusesWhatIsNotTheSame) {
  std::mt19937 random(5);
  const auto agree = [&](const Scene& a, const Scene& b) {
    const auto reference = cut(a, random);
    return align(reference, cut(b, random)).has_value();
  };
  int unrelated = 0, occluded = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    unrelated += agree(texture(seed), texture(seed + 1000));
    // The left half is something near that moved on by 5 px over the background.
    const Scene background = texture(seed), near = texture(seed + 1000);
    const Scene before = [&](double x, double y) { return x < 0.0 ? near(x, y) : background(x, y); };
    const Scene after = [&](double x, double y) { return x < 5.0 ? near(x - 5.0, y) : background(x, y); };
    occluded += agree(before, after);
  }
  EXPECT_LE(unrelated, 5);
  EXPECT_LE(occluded, 10);
  // Along an edge nothing but rounding tells the position.
  const auto slanted = [](double slant) -> Scene {
    return [slant](double x, double y) { return 125.0 + 75.0 * std::tanh(0.7 * (x + slant * y)); };
  };
  const Scene flat = [](double, double) { return 100.0; };
  const Scene edge = [](double x, double) { return x < 0.2 ? 50.0 : 200.0; };
  std::mt19937 quiet(1);
  for (const Scene& scene : {flat, edge, slanted(-1.03), slanted(1.03)}) {
    const auto patch = cut(scene, quiet, 0.0);
    EXPECT_FALSE(align(patch, patch));
  }
}

TEST(PatchAlignment, RefusesPatchesThatCorrelateByLessThanSeventyPerCent) {
  std::mt19937 random(7);
  const auto reference = cut(texture(3), random);
  float least = 1.f;
  int refused = 0;
  for (double noise = 5.0; noise < 80.0; noise += 5.0) {
    const auto found = align(reference, cut(texture(3), random, noise));
    if (found) least = std::min(least, found->correlation);
    refused += !found;
  }
  EXPECT_GE(least, 0.7f);
  EXPECT_LT(least, 0.9f);
  EXPECT_GT(refused, 0);
}

TEST(PatchAlignment, RefusesAFartherShiftThanAskedFor) {
  std::mt19937 random(7);
  const auto reference = cut(texture(3), random);
  const auto current = cut(moved(texture(3), scaled(1.0), {0.0, -0.8}), random);
  NoiseOptions noise;
  noise.corner = 0.3;  // 3.9 of which bound the shift
  EXPECT_TRUE(align(reference, current, noise));
  noise.corner = 0.15;
  EXPECT_FALSE(align(reference, current, noise));
}

TEST(PatchAlignment, PatchesMayBeSpacedDifferently) {
  std::mt19937 random(7);
  const Eigen::Vector2d shift(0.6, -0.4);
  const auto reference = cut(texture(3), random);
  const auto current = cut(moved(texture(3), scaled(1.0), shift), Eigen::Vector2d::Zero(), 1.6, random);
  const auto found = align(reference, current, {}, Eigen::Vector2f::Zero(), 1.f, 1.6);
  ASSERT_TRUE(found);
  EXPECT_LT((found->shift.cast<double>() - shift).norm(), 0.15);
  EXPECT_GT(found->correlation, 0.95f);
}

TEST(PatchAlignment, RefusesWhatLiesOutside) {
  std::mt19937 random(5);
  const Scene scene = texture(2);
  const auto reference = cut(scene, random, 0.0);
  const auto at = [&](double x) { return cut(scene, {x, 0.0}, 1.0, random, 0.0); };
  EXPECT_FALSE(align(reference, cut(moved(scene, scaled(1.0), {2.5, 0.0}), random, 0.0)))
      << "farther than a corner is off";
  EXPECT_TRUE(align(reference, at(1.0), {}, {1.f, 0.f}));
  EXPECT_FALSE(align(reference, at(1.5), {}, {1.5f, 0.f}))
      << "the reference's square and its neighbours leave its patch";
  for (const float ratio : {1.6f, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_FALSE(align(reference, reference, {}, Eigen::Vector2f::Zero(), ratio))
        << "the warped square leaves the current patch";
}

TEST(PatchAlignment, IsTheSameToTheBitWithAndWithoutVectors) {
  std::mt19937 random(23);
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  int compared = 0;
  for (unsigned trial = 0; trial < 200; ++trial) {
    const Scene scene = texture(trial);
    const Eigen::Vector2d shift(part(random), part(random));
    const Eigen::Matrix2d warp = scaled(1.0 + 0.2 * part(random));
    const auto reference = cut(scene, random);
    const auto current = cut(moved(scene, warp, shift), random);
    const Eigen::Vector2f centre(0.4f * static_cast<float>(part(random)), 0.4f * static_cast<float>(part(random)));
    compared += !ofEveryKernel([&] {
                   const auto found = alignPatch({}, patchOf(reference), centre, patchOf(current), warp.cast<float>());
                   return found ? std::vector{found->shift.x(), found->shift.y(), found->sigma, found->correlation}
                                : std::vector<float>();
                 }).empty();
  }
  EXPECT_GT(compared, 100);
}

}  // namespace sdvo::test_patch_alignment
