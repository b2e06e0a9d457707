#include <gtest/gtest.h>

#include "../../src/ros/node/throttles.hpp"

namespace sdvo::test_report_throttle {

TEST(ReportThrottle, LetsAKindThroughOnce) {
  ReportThrottle throttle;
  EXPECT_TRUE(throttle.allows("late"));
  EXPECT_FALSE(throttle.allows("late"));
  EXPECT_TRUE(throttle.allows("dark"));
}

TEST(ReportThrottle, NumbersMakeNoOtherKind) {
  ReportThrottle throttle;
  EXPECT_TRUE(throttle.allows("refused: v has 611 elements, u has 612"));
  EXPECT_FALSE(throttle.allows("refused: v has 7 elements, u has 1.5e-3"));
  EXPECT_TRUE(throttle.allows("refused: dv has 611 elements, u has 612"));
  EXPECT_TRUE(throttle.allows("/cam0/image_raw"));
  EXPECT_TRUE(throttle.allows("/cam1/image_raw"));
  EXPECT_TRUE(throttle.allows("left image is 640x480"));
  EXPECT_FALSE(throttle.allows("left image is 752x480"));
}

}  // namespace sdvo::test_report_throttle
