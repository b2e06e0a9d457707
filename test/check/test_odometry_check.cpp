#include <gtest/gtest.h>

#include "../../src/check/odometry_check.hpp"
#include "../said.hpp"

namespace sdvo::test_odometry_check {

/// Of a hundred pairs as many are lost, or degraded.
Finding judged(int lost, int degraded) {
  OdometryCheck check;
  for (int i = 0; i < 100; ++i) {
    OdometryResult result;
    result.state = i < lost              ? TrackingState::kLost
                   : i < lost + degraded ? TrackingState::kDegraded
                                         : TrackingState::kTracking;
    result.reason = i < lost ? "too few matches" : "doubtful";
    check.add(result);
  }
  return check.judge();
}

TEST(OdometryCheck, NamesTheStatesAndTheReasonThatIsMostFrequent) {
  EXPECT_EQ(judged(0, 2).verdict, Verdict::kOk);
  EXPECT_EQ(judged(1, 0).verdict, Verdict::kWarn);
  EXPECT_EQ(judged(21, 0).verdict, Verdict::kFail);
  EXPECT_TRUE(contains(judged(2, 9).text(), "89 of 100 pairs TRACKING, 9 DEGRADED, 2 LOST"));
  EXPECT_TRUE(contains(judged(2, 9).text(), "most often: doubtful"));
  EXPECT_EQ(OdometryCheck().judge().verdict, Verdict::kOpen);
}

/// The odometry was `told` one readout and measures another one, s.
Finding shutter(double told, double measured) {
  OdometryCheck check(told);
  OdometryResult result;
  result.state = TrackingState::kTracking;
  result.readout = measured, result.readout_sigma = 0.0005;
  check.add(result);
  return check.shutter();
}

TEST(OdometryCheck, AReadoutIsAFaultUnlessTheOdometryIsToldOfIt) {
  EXPECT_EQ(OdometryCheck().shutter().verdict, Verdict::kOpen);
  EXPECT_EQ(shutter(0.0, 0.001).verdict, Verdict::kOk);
  EXPECT_EQ(shutter(0.025, 0.0256).verdict, Verdict::kOk);
  for (const double told : {0.0, 0.01, -0.0256}) {
    EXPECT_EQ(shutter(told, 0.0256).verdict, Verdict::kWarn) << told;
    EXPECT_TRUE(contains(shutter(told, 0.0256).text(), "calibration/readout to 0.0256")) << told;
  }
}

}  // namespace sdvo::test_odometry_check
