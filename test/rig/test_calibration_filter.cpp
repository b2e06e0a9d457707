// On windows made by hand; pairs are numbered, a window is known by its first and its last pair.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "stereo_descriptor_vo/motion/noise.hpp"
#include "stereo_descriptor_vo/rig/calibration_filter.hpp"

namespace sdvo::test_calibration_filter {

using Matrix = RigCalibration::Matrix;
using Vector = RigCalibration::Vector;

const double kSigma = 0.5 / CalibrationFilter::kTrust;  // px: an information of 4 in the windows' units

CalibrationOptions someOptions() {
  CalibrationOptions options;
  options.prior_offset = 0.5;
  options.prior_bend = -1.0;
  options.prior_sigma = kSigma;
  return options;
}

const Vector kPrior(0.5, -1.0);
const Matrix kInformation = Vector(12.0, 5.0).asDiagonal();  // of a window
// Distances that are significant of a window of that information.
const double kOffset = std::sqrt(noiseGate(1) / 12.0), kBend = std::sqrt(noiseGate(1) / 5.0);

/// Adds the window of these pairs that would find `own` without a prior.
void addWindow(CalibrationFilter& filter, int oldest, int newest, const Vector& own,
               const Matrix& information = kInformation) {
  const CalibrationBelief prior = filter.prior(oldest);
  RigCalibration result;
  result.value = (prior.information + information).inverse() * (prior.information * prior.mean + information * own);
  filter.note(oldest, newest, result, information);
}

/// What is left of a prior's standard deviation, as information in the windows' units.
double informationOf(double spread) {
  return 1.0 / std::pow(CalibrationFilter::kTrust * spread, 2);
}

TEST(CalibrationFilter, BeginsWithWhatTheOptionsSay) {
  CalibrationFilter filter(someOptions());
  EXPECT_LT((filter.prior(1).mean - kPrior).norm(), 1e-9);
  EXPECT_GT(filter.prior(1).information.diagonal().minCoeff(), 1e6) << "held until there is evidence";
  EXPECT_EQ(filter.calibration().value, kPrior);
  EXPECT_TRUE(filter.sigma().array().isNaN().all());
}

TEST(CalibrationFilter, KeepsWhatTheOptionsSayWhereTheEvidenceIsNotSignificant) {
  CalibrationFilter filter(someOptions());
  const Vector near = kPrior + Vector(0.9 * kOffset, -0.9 * kBend);
  for (int newest = 9; newest < 17; ++newest) addWindow(filter, newest - 8, newest, near);
  EXPECT_LT((filter.calibration().value - kPrior).norm(), 1e-5);
  EXPECT_GT(filter.prior(8).information.diagonal().minCoeff(), 1e6);
}

TEST(CalibrationFilter, MovesAsFarAsTheEvidenceIsSignificant) {
  CalibrationFilter filter(someOptions());
  const Vector far = kPrior + Vector(1.3 * kOffset, -1.5 * kBend);
  addWindow(filter, 1, 9, far);
  // Variance of the truth: square of the distance less the estimate's own variance.
  const CalibrationBelief prior = filter.prior(2);
  EXPECT_NEAR(prior.information(0, 0), informationOf(kOffset * std::sqrt(1.3 * 1.3 - 1.0)), 1e-3);
  EXPECT_NEAR(prior.information(1, 1), informationOf(kBend * std::sqrt(1.5 * 1.5 - 1.0)), 1e-3);
  EXPECT_LT((prior.mean - kPrior).norm(), 1e-9) << "the window overlaps the next one";
  addWindow(filter, 2, 10, far);
  const Vector moved = filter.calibration().value - kPrior;
  EXPECT_GT(moved[0], 0.1);
  EXPECT_LT(moved[0], 1.3 * kOffset);
  EXPECT_LT(moved[1], -0.1);
}

TEST(CalibrationFilter, ACalibrationThatIsHeldIsNotKnownForThat) {
  CalibrationFilter filter(someOptions());
  addWindow(filter, 1, 9, kPrior);
  EXPECT_GT(filter.prior(2).information.diagonal().minCoeff(), 1e6);
  const std::optional<Matrix> certain = filter.prior(2).certain_information;
  ASSERT_TRUE(certain);
  EXPECT_LT((*certain - informationOf(kSigma) * Matrix::Identity()).norm(), 1e-6);
}

TEST(CalibrationFilter, TheOptionsSigmaIsTheLargestSpread) {
  CalibrationFilter filter(someOptions());
  addWindow(filter, 1, 9, {100.0, 100.0});
  EXPECT_LT((filter.prior(2).information - informationOf(kSigma) * Matrix::Identity()).norm(), 1e-6);
}

TEST(CalibrationFilter, SaysHowWellTheWindowsMeasure) {
  CalibrationFilter filter(someOptions());
  addWindow(filter, 1, 9, kPrior);
  EXPECT_NEAR(filter.sigma()[0], kSigma / 2.0, 1e-9);
  EXPECT_NEAR(filter.sigma()[1], kSigma * 2.0 / 3.0, 1e-9);
}

TEST(CalibrationFilter, EstimatesWhatIsNotSignificant) {
  CalibrationFilter filter(someOptions());
  EXPECT_LT((filter.estimate().covariance - kSigma * kSigma * Matrix::Identity()).norm(), 1e-9) << "the options' alone";
  const Vector near = kPrior + Vector(0.9 * kOffset, -0.9 * kBend);
  addWindow(filter, 1, 9, near);
  const CalibrationEstimate found = filter.estimate();
  EXPECT_LT((filter.calibration().value - kPrior).norm(), 1e-5) << "held";
  EXPECT_NEAR(found.mean[0], (4.0 * kPrior[0] + 12.0 * near[0]) / 16.0, 1e-3);
  EXPECT_NEAR(found.covariance(0, 0), kSigma * kSigma * 4.0 / 16.0, 1e-9);
  CalibrationOptions held = someOptions();
  held.enabled = false;
  EXPECT_EQ(CalibrationFilter(held).estimate().covariance, Matrix(Matrix::Zero()));
}

TEST(CalibrationFilter, OfWindowsThatOverlapOneCounts) {
  CalibrationFilter filter(someOptions());
  for (const int newest : {5, 6, 7, 8}) {
    addWindow(filter, newest - 4, newest, {100.0, -100.0});
    EXPECT_LT((filter.prior(newest - 4).mean - kPrior).norm(), 1e-9);
  }
  const CalibrationBelief belief = filter.prior(6);  // the first window has no pair in common with it
  EXPECT_LT((belief.information - (informationOf(kSigma) * Matrix::Identity() + kInformation)).norm(), 1e-6);
  EXPECT_NEAR(belief.mean[0], (4.0 * 0.5 + 12.0 * 100.0) / 16.0, 1e-3);
  EXPECT_NEAR(filter.prior(6).mean[0], belief.mean[0], 1e-12) << "counted once";
}

TEST(CalibrationFilter, OneEarlierWindowCountsAndTheOptionsStay) {
  CalibrationFilter filter(someOptions());
  addWindow(filter, 1, 5, {100.0, -100.0});
  addWindow(filter, 6, 10, {60.0, -60.0});
  const CalibrationBelief belief = filter.prior(11);
  EXPECT_LT((belief.information - (informationOf(kSigma) * Matrix::Identity() + kInformation)).norm(), 1e-6);
  EXPECT_NEAR(belief.mean[0], (4.0 * 0.5 + 12.0 * 60.0) / 16.0, 1e-3);
  EXPECT_NEAR(belief.mean[1], (4.0 * -1.0 - 5.0 * 60.0) / 9.0, 1e-3);
}

TEST(CalibrationFilter, AgreementOfManyWindowsWearsThePriorDown) {
  CalibrationFilter filter(someOptions());
  const Matrix own = 40.0 * Matrix::Identity();
  for (int k = 0; k < 50; ++k) addWindow(filter, 10 * k + 1, 10 * k + 9, {10.0, -10.0}, own);
  // In the end 40 of the window and 40 of the one before stand against 4 of the options.
  EXPECT_NEAR(filter.calibration().value[0], (4.0 * 0.5 + 80.0 * 10.0) / 84.0, 1e-3);
  EXPECT_NEAR(filter.calibration().value[1], (4.0 * -1.0 - 80.0 * 10.0) / 84.0, 1e-3);
}

TEST(CalibrationFilter, HoldsThePriorWhenNotEnabled) {
  CalibrationOptions options = someOptions();
  options.enabled = false;
  CalibrationFilter filter(options);
  addWindow(filter, 1, 9, {100.0, 100.0});
  EXPECT_LT((filter.prior(10).mean - kPrior).norm(), 1e-3);
  EXPECT_LT((filter.calibration().value - kPrior).norm(), 1e-3);
  EXPECT_TRUE(filter.sigma().array().isNaN().all());
}

TEST(CalibrationFilter, WhatIsLeftAtAPointIsKnownOnceTwentyWindowsToldOfIt) {
  CalibrationFilter filter(someOptions());
  for (int window = 1; window < 20; ++window) filter.noteCommon(0.02 + (window % 2) * 0.04);
  EXPECT_FALSE(filter.prior(1).common_sigma);
  filter.noteCommon(0.02);
  ASSERT_TRUE(filter.prior(1).common_sigma);
  // Their mean is 0.04 px^2.
  EXPECT_NEAR(*filter.prior(1).common_sigma, 0.2, 1e-9);
}

TEST(CalibrationFilter, WhatIsLeftAtAPointMayChange) {
  CalibrationFilter filter(someOptions());
  for (int window = 0; window < 1000; ++window) filter.noteCommon(0.01);
  for (int window = 0; window < 200; ++window) filter.noteCommon(0.09);
  EXPECT_GT(*filter.prior(1).common_sigma, std::sqrt(0.05));
  for (int window = 0; window < 2000; ++window) filter.noteCommon(0.09);
  EXPECT_NEAR(*filter.prior(1).common_sigma, 0.3, 1e-3);
}

/// A window that is refused after all asks for its prior as well.
TEST(CalibrationFilter, AskingForAPriorChangesNothing) {
  CalibrationFilter asked{CalibrationOptions{}}, other{CalibrationOptions{}};
  RigCalibration found;
  found.value << 0.3, -0.5;
  for (CalibrationFilter* filter : {&asked, &other}) filter->note(0, 4, found, 1e4 * Matrix::Identity());
  asked.prior(5);
  for (CalibrationFilter* filter : {&asked, &other}) filter->note(4, 8, found, 1e4 * Matrix::Identity());
  EXPECT_EQ(asked.prior(6).information, other.prior(6).information);
  EXPECT_EQ(asked.prior(6).mean, other.prior(6).mean);
}

}  // namespace sdvo::test_calibration_filter
