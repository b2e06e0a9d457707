#include <gtest/gtest.h>

#include "../../../test/synthetic_scene.hpp"
#include "../../../test/temporary_folder.hpp"
#include "../../experiments/depth_scale_fit.hpp"
#include "wall_drive.hpp"

namespace sdvo::test_depth_scale_fit {

namespace fs = std::filesystem;

/// Samples of a known curve with noise, a fifth of them wrong altogether.
std::vector<SizeSample> samplesOf(const std::function<double(double)>& curve, double noise_octaves) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> normal(0.0, noise_octaves);
  std::vector<SizeSample> samples;
  for (int i = 0; i < 2000; ++i) {
    const double first = 3.0 * std::pow(10.0, uniform(random));
    const double later = first * (1.0 + 2.0 * uniform(random));
    const double ratio = curve(later) / curve(first) * std::exp2(normal(random));
    samples.push_back({first, later, i % 5 == 0 ? 0.5 + 3.5 * uniform(random) : ratio});
  }
  return samples;
}

const ShapeFit& named(const std::vector<ShapeFit>& fits, const std::string& model) {
  for (const ShapeFit& fit : fits)
    if (fit.model == model) return fit;
  throw std::logic_error("no model " + model);
}

TEST(DepthScaleFit, RecoversAPowerDespiteOutliers) {
  const auto fits = fitShapes(samplesOf([](double d) { return 2.0 * std::pow(d, 0.7); }, 0.05));
  EXPECT_NEAR(named(fits, "a*d^b").exponent, 0.7, 0.02);
  EXPECT_LT(named(fits, "a*d^b").robust_cost, 0.8 * named(fits, "a*d").robust_cost);
}

TEST(DepthScaleFit, RecoversAnOffsetDespiteOutliers) {
  const auto fits = fitShapes(samplesOf([](double d) { return 0.8 * d + 4.0; }, 0.05));  // offset / slope = 5 px
  EXPECT_NEAR(named(fits, "a*d+b").offset, 5.0, 0.4);
  EXPECT_LT(named(fits, "a*d+b").robust_cost, 0.8 * named(fits, "a*d").robust_cost);
}

TEST(DepthScaleFit, ACircleOfFixedSizeInTheWorldNeedsNeither) {
  const auto fits = fitShapes(samplesOf([](double d) { return 0.72 * d; }, 0.05));
  EXPECT_NEAR(named(fits, "a*d+b").offset, 0.0, 0.3);
  EXPECT_NEAR(named(fits, "a*d^b").exponent, 1.0, 0.02);
  // Four fifths of the samples have a residual of 0.05 octaves, whose median size is 0.67 of that; outliers move it up.
  EXPECT_GT(named(fits, "a*d").median_residual, 0.03);
  EXPECT_LT(named(fits, "a*d").median_residual, 0.06);
}

TEST(DepthScaleFit, RefusesAHandfulOfSamples) {
  const std::string error = errorOf([] { fitShapes({{5.0, 10.0, 2.0}}); });
  EXPECT_NE(error.find("only 1 features"), std::string::npos) << error;
}

ReferenceSequence towardsAWall(const fs::path& folder, int pairs, double step) {
  const Trajectory trajectory = synthetic::writeWallDrive(folder, pairs, step);
  return {folder.filename(), KittiSequence(folder), pairs, trajectory};
}

TEST(TryCurves, CountsCorrectMatchesOfAPairAndComparesThemWithTheStandardSize) {
  const TemporaryFolder folder;
  const ReferenceSequence near = towardsAWall(folder.path() / "near", 2, 0.1);  // one pair of views
  const ReferenceSequence far = towardsAWall(folder.path() / "far", 5, 0.7);    // two: one and four steps apart
  DepthScaleOptions standard, small;
  standard.scale_normalisation = small.scale_normalisation = false;
  small.constant_size = 4.0;
  const std::vector<DepthScaleOptions> curves = {standard, small,
                                                 DepthScaleOptions{}.completedFor(DescriptorType::kFreak)};
  const auto of_near = tryCurves({near}, {}, curves, 150), of_far = tryCurves({far}, {}, curves, 150);
  const auto of_both = tryCurves({near, far}, {}, curves, 150);
  ASSERT_EQ(of_both.size(), curves.size());
  for (std::size_t k = 0; k < curves.size(); ++k) {
    EXPECT_NEAR(of_near[k].gain, 100.0 * (of_near[k].correct / of_near[0].correct - 1.0), 1e-9) << k;
    EXPECT_NEAR(of_both[k].correct, (of_near[k].correct + 2.0 * of_far[k].correct) / 3.0, 1e-9) << k;
    EXPECT_NEAR(of_both[k].gain, (of_near[k].gain + of_far[k].gain) / 2.0, 1e-9) << k;
  }
  EXPECT_GT(of_near[0].correct, 75.0) << "most of 150, as little changes";
  EXPECT_GT(of_far[2].gain, 0.0) << "sizes that follow the depth are for views that differ in scale";
}

}  // namespace sdvo::test_depth_scale_fit
