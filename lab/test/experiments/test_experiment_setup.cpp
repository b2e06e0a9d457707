#include <gtest/gtest.h>

#include "../../experiments/experiment_setup.hpp"

namespace sdvo::test_experiment_setup {

std::string hashOf(PipelineOptions options) {
  return hashOptions(listOptions(options));
}

TEST(ExperimentSetup, ProductHasTheNodeletsDefaultsAndMoreCorners) {
  PipelineOptions product = ExperimentSetup().options();
  const PipelineOptions defaults;
  FeatureDetectorOptions& detector = product.stereo_features.detector;
  EXPECT_GT(detector.max_features, 2 * 2320);
  detector.max_features = defaults.stereo_features.detector.max_features;
  detector.min_contrast = defaults.stereo_features.detector.min_contrast;
  detector.corner_quality = defaults.stereo_features.detector.corner_quality;
  EXPECT_EQ(hashOf(product), hashOf(defaults));
}

TEST(ExperimentSetup, PaperHasAllDifferences) {
  ExperimentSetup paper, with, without;
  paper.setup = with.setup = without.setup = Setup::kPaper;
  for (const SetupDifference& difference : paperDifferences()) {
    with.settings.insert(with.settings.end(), difference.with.begin(), difference.with.end());
    without.settings.insert(without.settings.end(), difference.without.begin(), difference.without.end());
  }
  EXPECT_EQ(hashOf(paper.options()), hashOf(with.options()));
  EXPECT_NE(hashOf(paper.options()), hashOf(without.options()));
}

/// The paper's results must not follow the nodelets' defaults.
TEST(ExperimentSetup, PaperHasDetectorAndTolerancesOfItsOwn) {
  ExperimentSetup paper;
  paper.setup = Setup::kPaper;
  const ExperimentOptions options = paper.options();
  const FeatureDetectorOptions& detector = options.stereo_features.detector;
  const StereoMatcherOptions& stereo = options.stereo_features.stereo;
  EXPECT_EQ(detector.type, DetectorType::kFast);
  EXPECT_EQ(options.noise * detector.min_contrast, 3.0) << "grey levels";
  EXPECT_EQ(detector.bucket_size, 50);
  EXPECT_EQ(detector.min_spacing, 0.0);
  EXPECT_TRUE(options.tracks);
  EXPECT_EQ(stereo.max_epipolar_residual, 1.5);
  EXPECT_EQ(stereo.min_disparity, 0.5);
  const ExperimentOptions product = ExperimentSetup().options();
  EXPECT_FALSE(product.tracks);
  EXPECT_EQ(product.noise, 0.0) << "the product's limit is in units of the noise";
}

/// A row of the ablation that changed nothing would be no row.
TEST(ExperimentSetup, EveryDifferenceChangesBothSetups) {
  for (const auto* differences : {&paperDifferences(), &otherDifferences()})
    for (const SetupDifference& difference : *differences) {
      ExperimentSetup product, changed;
      changed.settings = difference.with;
      EXPECT_NE(hashOf(product.options()), hashOf(changed.options())) << difference.name;
      ExperimentSetup paper, restored;
      paper.setup = restored.setup = Setup::kPaper;
      restored.settings = difference.without.empty() ? difference.with : difference.without;
      EXPECT_NE(hashOf(paper.options()), hashOf(restored.options())) << difference.name;
    }
}

/// FREAK's sizes would cost another descriptor its matches.
TEST(ExperimentSetup, SizesForMatchingAreFreaksAlone) {
  ExperimentSetup paper;
  paper.setup = Setup::kPaper;
  EXPECT_EQ(paper.options().stereo_features.sizeCurve().max_size, 60.0);
  const FeatureExtractorOptions brief = paper.withDescriptor(DescriptorType::kBrief).options().stereo_features;
  EXPECT_EQ(brief.descriptor.type, DescriptorType::kBrief);
  EXPECT_TRUE(brief.descriptor.oriented);
  EXPECT_EQ(brief.sizeCurve().max_size, DepthScaleOptions{}.completedFor(DescriptorType::kBrief).max_size);
}

TEST(ExperimentSetup, SizesOfSiftAreFixed) {
  ExperimentSetup paper;
  paper.setup = Setup::kPaper;
  const DepthScaleOptions sizes = paper.withDescriptor(DescriptorType::kSift).options().stereo_features.size_curve;
  EXPECT_EQ(sizes.slope, 0.2);
  EXPECT_EQ(sizes.min_size, 4.0);
  EXPECT_EQ(sizes.max_size, 32.0);
}

TEST(ExperimentSetup, SettingsWinOverTheSetup) {
  ExperimentSetup setup;
  setup.setup = Setup::kPaper;
  setup.settings = {"descriptor/oriented=false"};
  EXPECT_FALSE(setup.options().stereo_features.descriptor.oriented);
  EXPECT_FALSE(setup.options().stereo_features.detector.subpixel);
}

}  // namespace sdvo::test_experiment_setup
