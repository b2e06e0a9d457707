// On windows made by hand; pairs are numbered, a window is known by its first and its last pair.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "stereo_descriptor_vo/odometry/calibration_filter.hpp"

namespace sdvo {
namespace {

using Matrix = RigCalibration::Matrix;
using Vector = RigCalibration::Vector;

CalibrationOptions someOptions() {
  CalibrationOptions options;
  options.prior_offset = 0.5;
  options.prior_bend = -1.0;
  options.prior_sigma = 2.0;
  options.trust = 0.25;
  options.memory = 0.5;
  return options;
}

/// Of the options: trust makes it 1 / (0.25 * 2)^2.
Matrix optionInformation() {
  return 4.0 * Matrix::Identity();
}

Matrix information(double offset, double bend) {
  return Vector(offset, bend).asDiagonal();
}

RigCalibration calibrationOf(double offset, double bend) {
  RigCalibration calibration;
  calibration.value << offset, bend;
  return calibration;
}

void expectBelief(const CalibrationBelief& belief, const Vector& mean, const Matrix& information) {
  EXPECT_LT((belief.mean - mean).norm(), 1e-9) << belief.mean.transpose() << " for " << mean.transpose();
  EXPECT_LT((belief.information - information).norm(), 1e-9) << belief.information << "\nfor\n" << information;
}

TEST(CalibrationFilter, BeginsWithWhatTheOptionsSay) {
  CalibrationFilter filter(someOptions());
  expectBelief(filter.prior(1), {0.5, -1.0}, optionInformation());
  EXPECT_EQ(filter.calibration().value, Vector(0.5, -1.0));
  EXPECT_TRUE(filter.sigma().array().isNaN().all());
}

TEST(CalibrationFilter, TellsTheLastWindowsResultAndHowWellItIsKnown) {
  CalibrationFilter filter(someOptions());
  filter.note(5, calibrationOf(0.3, -0.7), information(12.0, 5.0));
  EXPECT_EQ(filter.calibration().value, Vector(0.3, -0.7));
  // Four times 1 / sqrt(4 + 12) and 1 / sqrt(4 + 5).
  EXPECT_NEAR(filter.sigma()[0], 4.0 * 0.25, 1e-12);
  EXPECT_NEAR(filter.sigma()[1], 4.0 / 3.0, 1e-12);
}

TEST(CalibrationFilter, AWindowIsNoPriorForOneThatSharesAPairWithIt) {
  CalibrationFilter filter(someOptions());
  filter.note(5, calibrationOf(0.3, -0.7), information(12.0, 5.0));
  expectBelief(filter.prior(5), {0.5, -1.0}, optionInformation());
  // The window's result had the options' share in it already, which is not counted twice.
  expectBelief(filter.prior(6), {0.3, -0.7}, optionInformation() + information(12.0, 5.0));
  expectBelief(filter.prior(6), {0.3, -0.7}, optionInformation() + information(12.0, 5.0));
}

TEST(CalibrationFilter, OfWindowsThatOverlapOneCounts) {
  CalibrationFilter filter(someOptions());
  for (const int newest : {5, 6, 7, 8}) {
    filter.note(newest, calibrationOf(0.1 * newest, -0.7), information(12.0, 5.0));
    expectBelief(filter.prior(newest - 4), {0.5, -1.0}, optionInformation());
  }
  expectBelief(filter.prior(6), {0.5, -0.7}, optionInformation() + information(12.0, 5.0));
}

TEST(CalibrationFilter, EarlierWindowsFadeAndTheOptionsStay) {
  CalibrationFilter filter(someOptions());
  filter.note(5, calibrationOf(0.3, -0.7), information(12.0, 5.0));
  filter.prior(6);
  filter.note(10, calibrationOf(0.4, -0.6), information(8.0, 2.0));
  const CalibrationBelief belief = filter.prior(11);
  EXPECT_LT((belief.information - (optionInformation() + information(6.0 + 8.0, 2.5 + 2.0))).norm(), 1e-9);
  // What each window added to its own prior: I * mean = (prior + I) * result - prior * its mean.
  const double first = (4.0 + 12.0) * 0.3 - 4.0 * 0.5;
  const double second = (4.0 + 12.0 + 8.0) * 0.4 - (4.0 + 12.0) * 0.3;
  EXPECT_NEAR(belief.mean[0], (4.0 * 0.5 + 0.5 * first + second) / (4.0 + 6.0 + 8.0), 1e-9);
}

TEST(CalibrationFilter, AgreementOfManyWindowsWearsThePriorDown) {
  CalibrationFilter filter(someOptions());
  // Every window measures (1, 0) with the same precision; its result is the mean weighted with its prior.
  for (int k = 0; k < 50; ++k) {
    const CalibrationBelief prior = filter.prior(10 * k + 1);
    const Matrix own = information(40.0, 40.0);
    RigCalibration result;
    result.value = (prior.information + own).inverse() * (prior.information * prior.mean + own * Vector(1.0, 0.0));
    filter.note(10 * k + 9, result, own);
  }
  // In the end 40 of the window and 2 * 40 of the fading past stand against 4 of the options.
  EXPECT_NEAR(filter.calibration().value[0], (4.0 * 0.5 + 120.0 * 1.0) / 124.0, 1e-6);
  EXPECT_NEAR(filter.calibration().value[1], (4.0 * -1.0) / 124.0, 1e-6);
}

TEST(CalibrationFilter, HoldsThePriorWhenNotEnabled) {
  CalibrationOptions options = someOptions();
  options.enabled = false;
  CalibrationFilter filter(options);
  const CalibrationBelief prior = filter.prior(1);
  EXPECT_LT((prior.mean - Vector(0.5, -1.0)).norm(), 1e-9);
  EXPECT_GE(prior.information.diagonal().minCoeff(), 1e11);
  filter.note(5, calibrationOf(0.5, -1.0), information(12.0, 5.0));
  EXPECT_TRUE(filter.sigma().array().isNaN().all());
}

TEST(CalibrationFilter, WhatIsLeftAtAPointIsKnownOnceTwentyWindowsToldOfIt) {
  CalibrationFilter filter(someOptions());
  for (int window = 1; window < 20; ++window) filter.noteCommon(0.02 + (window % 2) * 0.04);
  EXPECT_FALSE(filter.prior(1).common_sigma);
  filter.noteCommon(0.02);
  ASSERT_TRUE(filter.prior(1).common_sigma);
  // Their mean is 0.04 px^2, and neighbours err alike.
  EXPECT_NEAR(*filter.prior(1).common_sigma, std::sqrt(1.4 * 0.04), 1e-9);
}

TEST(CalibrationFilter, WhatIsLeftAtAPointMayChange) {
  CalibrationFilter filter(someOptions());
  for (int window = 0; window < 1000; ++window) filter.noteCommon(0.01);
  for (int window = 0; window < 200; ++window) filter.noteCommon(0.09);
  EXPECT_GT(*filter.prior(1).common_sigma, std::sqrt(1.4 * 0.05));
  for (int window = 0; window < 2000; ++window) filter.noteCommon(0.09);
  EXPECT_NEAR(*filter.prior(1).common_sigma, std::sqrt(1.4 * 0.09), 1e-3);
}

}  // namespace
}  // namespace sdvo
