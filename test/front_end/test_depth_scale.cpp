#include <gtest/gtest.h>

#include "../../src/front_end/depth_scale.hpp"
#include "../said.hpp"

namespace sdvo::test_depth_scale {

DepthScaleOptions plainCurve() {
  DepthScaleOptions options;
  options.slope = 0.5;
  options.exponent = 1.0;
  options.offset = 0.0;
  options.min_size = 5.0;
  options.max_size = 30.0;
  options.constant_size = 9.0;
  return options;
}

TEST(DepthScale, IsProportionalToDisparityBetweenTheBounds) {
  const DepthScale scale(plainCurve());
  for (const double disparity : {10.0, 17.3, 40.0, 60.0}) EXPECT_NEAR(scale.size(disparity), 0.5 * disparity, 1e-12);
}

TEST(DepthScale, StaysWithinTheBounds) {
  const DepthScale scale(plainCurve());
  for (const double disparity : {0.01, 1.0, 10.0}) EXPECT_EQ(scale.size(disparity), 5.0) << disparity;
  for (const double disparity : {60.0, 61.0, 1e6}) EXPECT_EQ(scale.size(disparity), 30.0) << disparity;
}

TEST(DepthScale, FollowsExponentAndOffset) {
  DepthScaleOptions options = plainCurve();
  options.exponent = 0.5;
  options.slope = 2.0;
  options.offset = 3.0;
  EXPECT_NEAR(DepthScale(options).size(16.0), 2.0 * 4.0 + 3.0, 1e-12);
}

TEST(DepthScale, IsConstantWithoutNormalisation) {
  DepthScaleOptions options = plainCurve();
  options.scale_normalisation = false;
  for (const double disparity : {0.5, 20.0, 300.0}) EXPECT_EQ(DepthScale(options).size(disparity), 9.0);
}

TEST(DepthScale, RefusesBoundsThatLeaveNoSize) {
  DepthScaleOptions options = plainCurve();
  options.min_size = 30.5;
  expectError([&] { DepthScale{options}; }, {"min_size"});
  options.min_size = options.max_size;
  EXPECT_EQ(DepthScale(options).size(1.0), 30.0);
}

TEST(DepthScale, RefusesWhatNoDescriptorCompleted) {
  for (double DepthScaleOptions::*field :
       {&DepthScaleOptions::slope, &DepthScaleOptions::min_size, &DepthScaleOptions::max_size}) {
    DepthScaleOptions options = plainCurve();
    options.*field = 0.0;
    EXPECT_THROW(DepthScale{options}, std::invalid_argument);
    options.scale_normalisation = false;  // which reads none of them
    EXPECT_EQ(DepthScale(options).size(1.0), 9.0);
  }
}

TEST(DepthScale, EveryDescriptorCompletesTheCurveAndWhatIsSetStays) {
  const DepthScaleOptions set = plainCurve();
  for (int type = 0; type < static_cast<int>(namesOf(DescriptorType{}).size()); ++type) {
    const auto own = DepthScaleOptions{}.completedFor(static_cast<DescriptorType>(type));
    EXPECT_NO_THROW(DepthScale{own}) << nameOf(static_cast<DescriptorType>(type));
    const DepthScaleOptions completed = set.completedFor(static_cast<DescriptorType>(type));
    EXPECT_EQ(completed.slope, set.slope);
    EXPECT_EQ(completed.min_size, set.min_size);
    EXPECT_EQ(completed.max_size, set.max_size);
  }
}

/// The smallest fields of FREAK are a pixel wide at 4 px, and docs/how_it_works.md names the depths of both limits.
TEST(DepthScale, FreakFollowsDisparitiesOfThreeOctaves) {
  const DepthScale freak(DepthScaleOptions{}.completedFor(DescriptorType::kFreak));
  EXPECT_EQ(freak.size(5.0), 4.0);
  EXPECT_NEAR(freak.size(10.0), 7.2, 1e-12);
  EXPECT_NEAR(freak.size(44.0), 31.68, 1e-12);
  EXPECT_EQ(freak.size(50.0), 32.0);
}

}  // namespace sdvo::test_depth_scale
