#include <gtest/gtest.h>

#include <string>

#include "../../src/check/calibration_check.hpp"

namespace sdvo {
namespace test_calibration_check {

Finding judged(double baseline, int width = 1200, const std::string& unrectified = "") {
  return checkCalibration({700.0, 700.0, 600.0, 180.0, baseline, width, 360}, "plumb_bob", unrectified);
}

bool contains(const Finding& finding, const std::string& words) {
  return finding.verdict == Verdict::kWarn && finding.remedy.find(words) != std::string::npos;
}

TEST(CalibrationCheck, ARigThatARobotCarriesIsSound) {
  for (const double baseline : {0.011, 0.05, 0.54, 1.9}) EXPECT_EQ(judged(baseline).verdict, Verdict::kOk) << baseline;
  EXPECT_EQ(judged(0.05).what, "1200x360, f 700.0 px, baseline 50.0 mm, plumb_bob");
}

TEST(CalibrationCheck, ABaselineInOtherUnitsIsNamed) {
  EXPECT_TRUE(contains(judged(50.0), "baseline = 50 m: is P[3] of the right camera_info in pixels times mm or cm"));
  EXPECT_TRUE(contains(judged(5.0), "baseline = 5 m"));
  EXPECT_TRUE(contains(judged(0.00024), "baseline = 0.24 mm: does P[3] of the right camera_info lack the factor fx"));
}

TEST(CalibrationCheck, AFocalLengthOfAnotherImageSizeIsNamed) {
  EXPECT_TRUE(contains(judged(0.05, 200), "focal length"));
  EXPECT_TRUE(contains(judged(0.05, 6000), "focal length"));
}

TEST(CalibrationCheck, ImagesThatAreNotRectifiedAreNamedBesideADoubt) {
  EXPECT_TRUE(contains(judged(0.05, 1200, "R is not the identity"), "R is not the identity"));
  EXPECT_TRUE(contains(judged(50.0, 1200, "R is not the identity"), "R is not the identity"));
  EXPECT_TRUE(contains(judged(50.0, 1200, "R is not the identity"), "baseline = 50 m"));
}

}  // namespace test_calibration_check
}  // namespace sdvo
