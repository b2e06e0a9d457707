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
    check.add({}, result);
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

TEST(OdometryCheck, ACompensatedReadoutIsNoFault) {
  EXPECT_EQ(OdometryCheck().shutter().verdict, Verdict::kOpen);
  EXPECT_EQ(OdometryCheck(0.0256).shutter().text(), "a readout of 25.6 ms is compensated");
}

}  // namespace sdvo::test_odometry_check
