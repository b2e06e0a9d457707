// On windows made by hand; pairs are numbered, a window is known by its first and its last pair.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "../../src/motion/noise.hpp"
#include "../../src/rig/calibration_filter.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_calibration_filter {

using Matrix = RigCalibration::Matrix;
using Vector = RigCalibration::Vector;
constexpr int kRoll = RigEstimate::kRoll, kDelay = RigEstimate::kDelay;

const double kSigma =
    std::sqrt(1.0 / (4.0 * CalibrationFilter::kRealInformation));  // px: an information of 4 in a window's units

CalibrationOptions someOptions() {
  CalibrationOptions options;
  options.prior_offset = 0.5;
  options.prior_bend = -1.0;
  options.prior_sigma = kSigma;
  return options;
}

const Vector kPrior(0.5, -1.0, 0.0);
const Matrix kInformation = Vector(12.0, 5.0, 7.0).asDiagonal();  // as a window states it

const RigEstimate::CalibrationByRig kAhead =
    RigEstimate::CalibrationByRig::Identity();  // of a camera that does not turn, with f = -1 px

CalibrationBelief priorOf(const CalibrationFilter& filter) {
  return filter.prior(kAhead);
}

Vector meanOf(const CalibrationFilter& filter) {
  return filter.estimate().mean.head<3>();
}

Vector sigmaOf(const CalibrationFilter& filter) {
  return filter.estimate().covariance.diagonal().head<3>().cwiseSqrt();
}

/// Adds the window of these pairs that would find `own` without a prior.
void addWindow(CalibrationFilter& filter, int oldest, int newest, const Vector& own,
               const Matrix& information = kInformation,
               const RigEstimate::CalibrationByRig& calibration_by_rig = kAhead) {
  const CalibrationBelief prior = filter.prior(calibration_by_rig);
  RigCalibration result;
  result.value = (prior.information + information).inverse() * (prior.information * prior.mean + information * own);
  filter.update(oldest, newest, calibration_by_rig, result, information);
}

double normal(double distance, double variance) {
  return std::exp(-0.5 * distance * distance / variance) / std::sqrt(variance);
}

/// Moments of offset and bend in the mixture of a rig as the options say and one around that, given what windows
/// measured together. They show no roll.
struct Moments {
  Vector mean, variance;
};
Moments mixed(const Vector& own, const Matrix& information) {
  const Eigen::Vector2d variance =
      (CalibrationFilter::kRealInformation * information.diagonal().head<2>()).cwiseInverse();
  const Eigen::Vector2d distance = (own - kPrior).head<2>();
  double as_options = 1.0, other = 1.0;
  for (int i = 0; i < 2; ++i) {
    as_options *= normal(distance[i], variance[i]);
    other *= normal(distance[i], variance[i] + kSigma * kSigma);
  }
  const double probability = other / (other + as_options);
  const Eigen::Array2d gain = kSigma * kSigma / (variance.array() + kSigma * kSigma), moved = gain * distance.array();
  const Eigen::Array2d mean = probability * moved, square = probability * (gain * variance.array() + moved.square());
  Moments moments{kPrior, Vector::Zero()};
  moments.mean.head<2>() += mean.matrix();
  moments.variance.head<2>() = (square - mean.square()).matrix();
  return moments;
}

TEST(CalibrationFilter, BeginsAsTheOptionsSayOrAroundThat) {
  CalibrationFilter filter(someOptions());
  EXPECT_EQ(priorOf(filter).mean, kPrior);
  EXPECT_EQ(filter.calibration().value, kPrior);
  EXPECT_NEAR(filter.estimate().covariance(0, 0), 0.5 * kSigma * kSigma, 1e-9) << "half of the rigs are exact";
  EXPECT_NEAR(priorOf(filter).information(0, 0), 8.0, 1e-2) << "the same in a window's units";
  EXPECT_FALSE(filter.hasWindow());
}

TEST(CalibrationFilter, GoesOverFromTheOptionsToWhatWindowsMeasure) {
  const double sigma = 1.0 / std::sqrt(12.0 * CalibrationFilter::kRealInformation);
  for (const double sigmas : {0.0, 1.0, 2.0, 3.0, 5.0, 20.0}) {
    CalibrationFilter filter(someOptions());
    const Vector own = kPrior + sigmas * Vector(sigma, -0.5 * sigma, 0.0);
    addWindow(filter, 1, 9, own);
    const Moments expected = mixed(own, kInformation);
    EXPECT_LT((meanOf(filter) - expected.mean).norm(), 1e-9) << sigmas;
    EXPECT_LT((sigmaOf(filter).cwiseAbs2() - expected.variance).head<2>().norm(), 1e-9) << sigmas;
    EXPECT_LT((priorOf(filter).mean - expected.mean).norm(), 1e-9) << sigmas;
  }
}

TEST(CalibrationFilter, OfWindowsThatOverlapOneCounts) {
  CalibrationFilter filter(someOptions());
  const Vector own(30.0, -30.0, 0.0);
  for (const int newest : {5, 6, 7, 8}) {
    addWindow(filter, newest - 4, newest, own);
    EXPECT_LT((meanOf(filter) - mixed(own, kInformation).mean).norm(), 1e-9) << newest;
  }
  addWindow(filter, 6, 14, own);  // the first window has no pair in common with it
  EXPECT_LT((meanOf(filter) - mixed(own, 2.0 * kInformation).mean).norm(), 1e-9);
}

/// In a slow motion one key frame stays for many pairs: the window must not follow noise that the filter takes for
/// none.
TEST(CalibrationFilter, AWindowUsesWhatTheFilterKnowsWhileOneKeyFrameStays) {
  CalibrationFilter filter{CalibrationOptions()};
  const Vector noise(0.05, 0.02, 0.0);  // px: two standard deviations of a window
  for (int newest = 2; newest < 60; ++newest) {
    addWindow(filter, 1, newest, noise, 1600.0 * Matrix::Identity());
    const RigEstimate used = filter.compensated();
    EXPECT_NEAR(used.mean[0], filter.calibration().value[0], 1e-12) << "what is reported is what the window used";
    EXPECT_GE(used.covariance(0, 0), std::pow(used.mean[0] - meanOf(filter)[0], 2));
  }
  EXPECT_LT(meanOf(filter)[0], 0.3 * noise[0]);
  EXPECT_LT(filter.compensated().mean[0], 0.6 * noise[0]);
}

TEST(CalibrationFilter, ManyWindowsKnowMoreAndPoorOnesTakeNothingAway) {
  CalibrationFilter filter(someOptions());
  const Vector own(3.5, -2.0, 0.0);
  double before = 2.0 * kSigma;
  for (int k = 0; k < 50; ++k) {
    addWindow(filter, 10 * k + 1, 10 * k + 9, own);
    EXPECT_LT(sigmaOf(filter)[0], before) << k;
    before = sigmaOf(filter)[0];
  }
  EXPECT_LT((meanOf(filter) - mixed(own, 50.0 * kInformation).mean).norm(), 1e-6);
  for (int k = 50; k < 70; ++k) addWindow(filter, 10 * k + 1, 10 * k + 9, kPrior, 1e-3 * kInformation);
  EXPECT_LT((filter.calibration().value - own).norm(), 0.1);
}

TEST(CalibrationFilter, WhatIsOldIsKnownLess) {
  CalibrationFilter filter(someOptions());
  addWindow(filter, 1, 9, {3.5, -2.0, 0.0}, 1e6 * kInformation);
  const double before = sigmaOf(filter)[0];
  for (int second = 0; second < 100; ++second) filter.predict(1.0);
  EXPECT_NEAR(sigmaOf(filter)[0], 0.5, 0.02) << "half a pixel in 100 s";
  EXPECT_LT(before, 0.01);
  EXPECT_LT((meanOf(filter) - Vector(3.5, -2.0, 0.0)).norm(), 0.1);
}

constexpr double kFocal = 400.0;  // px

StereoCamera someCamera() {
  return {kFocal, kFocal, 500.0, 300.0, 0.1, 1000, 600};
}

TEST(CalibrationFilter, AKnockMakesOffsetBendAndRollUnknown) {
  CalibrationFilter filter(someOptions());
  addWindow(filter, 1, 9, {3.5, -2.0, 0.0}, 1e6 * kInformation);
  filter.widen(someCamera(), Eigen::Vector3d(0.0, 0.25 / (kFocal * kFocal), 1e-6).asDiagonal());
  const RigEstimate::Matrix covariance = filter.estimate().covariance;
  EXPECT_NEAR(covariance(0, 0), 0.25, 0.02);
  EXPECT_NEAR(covariance(0, 1), 0.25, 0.02) << "a turn about the vertical axis moves offset and bend alike";
  EXPECT_GT(covariance(RigEstimate::kRoll, RigEstimate::kRoll), 0.3e-6) << "as far as its prior";
}

TEST(CalibrationFilter, HoldsThePriorWhenNotEnabled) {
  CalibrationOptions options = someOptions();
  options.enabled = false;
  CalibrationFilter filter(options);
  EXPECT_TRUE(sigmaOf(filter).isZero());
  addWindow(filter, 1, 9, {100.0, 100.0, 100.0});
  EXPECT_EQ(priorOf(filter).mean, kPrior);
  EXPECT_LT((filter.calibration().value - kPrior).norm(), 0.01) << "of 100 px";
  EXPECT_EQ(meanOf(filter), kPrior);
}

RigEstimate::CalibrationByRig turning(double yaw) {
  return RigEstimate::calibrationByRig(someCamera(), {0.0, yaw, 0.0});
}

/// A window of a rig without misalignment whose right image is so late beyond what is compensated.
void addTurn(CalibrationFilter& filter, int k, double yaw, double delay) {
  const double shown = kFocal * yaw * (delay - filter.delay());
  addWindow(filter, 10 * k + 1, 10 * k + 9, Vector(shown, shown, 0.0), 1e4 * Matrix::Identity(), turning(yaw));
}

TEST(CalibrationFilter, ADelayIsWhatFollowsTheYawAndAnOffsetWhatStays) {
  for (const double delay : {-0.003, 0.0, 0.001, 0.003}) {
    CalibrationFilter filter{CalibrationOptions()};
    addTurn(filter, 0, 0.5, delay);
    const RigEstimate one = filter.estimate();
    if (delay != 0.0) {
      EXPECT_LT(one.covariance(0, kDelay), -0.5 * std::sqrt(one.covariance(0, 0) * one.covariance(kDelay, kDelay)))
          << "one turn shows their sum";
    }
    EXPECT_LT(one.covariance(kDelay, kDelay), 0.003 * 0.003);
    for (int k = 1; k < 20; ++k) addTurn(filter, k, k % 2 ? -0.5 : 0.5, delay);
    EXPECT_NEAR(filter.delay(), delay, 1e-4);
    EXPECT_LT(meanOf(filter).norm(), 0.05) << delay;
    EXPECT_LT((filter.prior(turning(1.0)).mean).norm(), 0.05) << "it is compensated";
  }
}

TEST(CalibrationFilter, ARollIsATiltOfDisparities) {
  CalibrationFilter filter{CalibrationOptions()};
  for (int k = 0; k < 5; ++k)
    addWindow(filter, 10 * k + 1, 10 * k + 9, {0.0, 0.0, -kFocal * 0.002}, 1e4 * Matrix::Identity(), turning(0.0));
  EXPECT_NEAR(filter.estimate().mean[kRoll], 0.002, 1e-4);
  EXPECT_LT(meanOf(filter).head<2>().norm(), 0.05);
  EXPECT_NEAR(filter.prior(turning(0.0)).mean[2], -kFocal * 0.002, 0.05);
}

TEST(CalibrationFilter, RowsShowRollAndDelayToo) {
  const CalibrationOptions options;
  const std::pair<int, double> both[] = {{kRoll, options.right_roll_sigma}, {kDelay, options.right_delay_sigma}};
  for (const auto& [parameter, prior] : both) {
    CalibrationFilter filter{options};
    const double measured = prior / 15.0;
    EXPECT_NEAR(std::sqrt(filter.estimate().covariance(parameter, parameter)), std::sqrt(0.5) * prior, 1e-9)
        << "half of the rigs have none";
    for (const double shown : {measured, prior}) {
      filter.updateByRows(parameter, shown, measured);
      const double mean = filter.estimate().mean[parameter];
      EXPECT_LE(mean, shown);
      EXPECT_NEAR(mean, shown > measured ? shown : 0.0, 0.25 * measured) << "as far as chance does not explain it";
      EXPECT_GT(filter.estimate().covariance(parameter, parameter) + 1e-12, (shown - mean) * (shown - mean) / 9.0);
    }
    for (int second = 0; second < 100; ++second) filter.predict(1.0);
    EXPECT_NEAR(filter.estimate().mean[parameter], prior, 0.25 * measured) << "rows have a memory of their own";
  }
}

/// As a late right image has it: points far away, in the middle and towards the corners.
TEST(RigEstimate, CalibrationByRigIsThatOfARightImageThatIsLate) {
  const StereoCamera camera = someCamera();
  constexpr double kLate = 0.002;  // s
  for (const Eigen::Vector3d& rate : {Eigen::Vector3d(0.0, 0.4, 0.0), Eigen::Vector3d(0.0, 0.0, 0.4)})
    for (const double u : {500.0, 100.0, 900.0})
      for (const double v : {300.0, 100.0}) {
        Vector6d turn = Vector6d::Zero();
        turn.tail<3>() = kLate * rate;
        const Eigen::Vector3d late = camera.project(expSE3(turn).inverse() * camera.backProject(u, v, 1e-3));
        RigCalibration shown;
        shown.value = RigEstimate::calibrationByRig(camera, rate).col(kDelay) * kLate;
        const double disparity_error = u - late.x();  // the left one is at u, the right one would be, too
        EXPECT_NEAR(shown.disparityError(camera, u, v), disparity_error, 0.01) << rate.transpose() << " at " << u;
      }
}

/// The optimizer fills one triangle of its matrices.
TEST(CalibrationFilter, HalvesThatDifferDoNotGrow) {
  CalibrationFilter filter(someOptions());
  Matrix information = 1e4 * Matrix::Identity();
  information(0, 1) = 1e-3;
  for (int k = 0; k < 300; ++k) addWindow(filter, k, k + 8, kPrior, information);
  const CalibrationBelief prior = priorOf(filter);
  EXPECT_EQ(prior.information(0, 1), prior.information(1, 0));
  EXPECT_LT((filter.calibration().value - kPrior).norm(), 1e-3);
}

TEST(CalibrationFilter, WhatIsLeftAtAPointIsKnownOnceTwentyWindowsToldOfIt) {
  CalibrationFilter filter(someOptions());
  for (int window = 1; window < 20; ++window) filter.updateCommon(0.02 + (window % 2) * 0.04);
  EXPECT_FALSE(priorOf(filter).common_sigma);
  filter.updateCommon(0.02);
  ASSERT_TRUE(priorOf(filter).common_sigma);
  // Their mean is 0.04 px^2.
  EXPECT_NEAR(*priorOf(filter).common_sigma, 0.2, 1e-9);
}

TEST(CalibrationFilter, WhatIsLeftAtAPointMayChange) {
  CalibrationFilter filter(someOptions());
  for (int window = 0; window < 1000; ++window) filter.updateCommon(0.01);
  for (int window = 0; window < 200; ++window) filter.updateCommon(0.09);
  EXPECT_GT(*priorOf(filter).common_sigma, std::sqrt(0.05));
  for (int window = 0; window < 2000; ++window) filter.updateCommon(0.09);
  EXPECT_NEAR(*priorOf(filter).common_sigma, 0.3, 1e-3);
}

}  // namespace sdvo::test_calibration_filter
