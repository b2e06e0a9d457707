#include <gtest/gtest.h>

#include "../../src/check/calibration_check.hpp"

namespace sdvo::test_calibration_check {

Finding judged(double baseline, int width = 1200, const std::string& unrectified = "") {
  return checkCalibration({700.0, 700.0, 0.5 * width, 180.0, baseline, width, 360}, "plumb_bob", unrectified);
}

bool contains(const Finding& finding, const std::string& words) {
  return finding.verdict == Verdict::kWarn && finding.remedy.find(words) != std::string::npos;
}

TEST(CalibrationCheck, ARigThatARobotCarriesIsSound) {
  for (const double baseline : {0.004, 0.05, 0.54, 2.7}) EXPECT_EQ(judged(baseline).verdict, Verdict::kOk) << baseline;
  EXPECT_EQ(judged(0.05).what, "1200x360, f 700.0 px, baseline 50.0 mm, plumb_bob");
}

TEST(CalibrationCheck, ABaselineInOtherUnitsIsNamed) {
  EXPECT_TRUE(contains(judged(50.0), "baseline = 50 m: is P[3] of the right camera_info in pixels times mm or cm"));
  EXPECT_TRUE(contains(judged(5.0), "baseline = 5 m"));
  EXPECT_TRUE(contains(judged(0.00024), "baseline = 0.24 mm: does P[3] of the right camera_info lack the factor fx"));
}

TEST(CalibrationCheck, AFocalLengthOfAnotherImageSizeIsNamed) {
  EXPECT_TRUE(contains(judged(0.05, 60), "focal length"));
  EXPECT_TRUE(contains(judged(0.05, 18000), "focal length"));
  for (const int width : {200, 6000}) EXPECT_EQ(judged(0.05, width).verdict, Verdict::kOk) << "tele and wide lenses";
}

TEST(CalibrationCheck, APrincipalPointOfAnotherImageSizeIsNamed) {
  const auto at = [](double cx, double cy) {
    return checkCalibration({700.0, 700.0, cx, cy, 0.05, 1200, 360}, "plumb_bob", "");
  };
  EXPECT_TRUE(contains(at(300.0, 90.0), "binning_x")) << "divided by the binning once too often";
  EXPECT_TRUE(contains(at(1200.0, 360.0), "another size"));
  EXPECT_TRUE(contains(at(600.0, 340.0), "far from the centre"));
  EXPECT_EQ(at(520.0, 300.0).verdict, Verdict::kOk) << "without its sky";
}

TEST(CalibrationCheck, ImagesThatAreNotRectifiedAreNamedBesideADoubt) {
  EXPECT_TRUE(contains(judged(0.05, 1200, "R is not the identity"), "R is not the identity"));
  EXPECT_TRUE(contains(judged(50.0, 1200, "R is not the identity"), "R is not the identity"));
  EXPECT_TRUE(contains(judged(50.0, 1200, "R is not the identity"), "baseline = 50 m"));
}

}  // namespace sdvo::test_calibration_check
