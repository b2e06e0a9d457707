#include <gtest/gtest.h>
#include <ros/serialization.h>

#include "message_samples.hpp"

namespace sdvo::ros_conversions::test_vo_info {

TEST(ToInfo, TellsResultAndImageSide) {
  OdometryResult result = trackedResult();
  result.state = TrackingState::kDegraded;
  result.reason = "motion predicted";
  result.epoch = 3;
  result.features = 900;
  result.matches = 400;
  result.inliers = 300;
  result.coverage = 0.75;
  result.rms = 0.5;
  result.match_time = 0.25;
  result.motion_time = 0.125;
  result.correction << 0.03, 0.0, -0.04, 0.0, 0.002, 0.0;
  result.distance = 42.5;
  result.keyframe_id = 17;
  result.probability = 0.75;
  result.disparity_offset = -0.25;
  result.disparity_offset_sigma = 0.05;
  result.disparity_bend = 1.5;
  result.right_delay = -0.0031;
  result.right_delay_sigma = 0.0001;
  result.readout = 0.025;
  result.readout_sigma = 0.0004;
  result.used_readout = 0.026;
  result.right_rotation << 0.001, -0.002, 0.003;
  FeaturesMessage features = someMessage();
  features.dropped_pairs = 6;
  const stereo_descriptor_vo::VoInfo info = toInfo(result, features);
  EXPECT_EQ(info.state, "DEGRADED");
  EXPECT_EQ(info.state_id, stereo_descriptor_vo::VoInfo::DEGRADED);
  EXPECT_EQ(info.reason, "motion predicted");
  EXPECT_EQ(info.epoch, 3u);
  EXPECT_EQ(info.detected, 1234u);
  EXPECT_EQ(info.features, 900u);
  EXPECT_EQ(info.matches, 400u);
  EXPECT_EQ(info.inliers, 300u);
  EXPECT_EQ(info.inlier_ratio, 0.75f);
  EXPECT_EQ(info.coverage, 0.75f);
  EXPECT_EQ(info.rms_reprojection_error, 0.5f);
  EXPECT_EQ(info.detect_time, 0.5f);
  EXPECT_EQ(info.stereo_time, 0.25f);
  EXPECT_EQ(info.describe_time, 0.125f);
  EXPECT_EQ(info.match_time, 0.25f);
  EXPECT_EQ(info.motion_time, 0.125f);
  EXPECT_EQ(info.dropped_pairs, 6u);
  EXPECT_FLOAT_EQ(info.correction_translation, 0.05f);
  EXPECT_FLOAT_EQ(info.correction_rotation, 0.002f);
  EXPECT_EQ(info.distance, 42.5);
  EXPECT_EQ(info.keyframe_id, 17u);
  EXPECT_FLOAT_EQ(info.probability, 0.75f);
  EXPECT_FLOAT_EQ(info.disparity_offset, -0.25f);
  EXPECT_FLOAT_EQ(info.disparity_offset_sigma, 0.05f);
  EXPECT_FLOAT_EQ(info.disparity_bend, 1.5f);
  EXPECT_FLOAT_EQ(info.right_delay, -0.0031f);
  EXPECT_FLOAT_EQ(info.right_delay_sigma, 0.0001f);
  EXPECT_FLOAT_EQ(info.readout, 0.025f);
  EXPECT_FLOAT_EQ(info.readout_sigma, 0.0004f);
  EXPECT_FLOAT_EQ(info.used_readout, 0.026f);
  EXPECT_FLOAT_EQ(info.right_rotation[1], -0.002f);

  result.matches = result.inliers = 0;
  EXPECT_EQ(toInfo(result, features).inlier_ratio, 0.f);
}

TEST(ToInfo, IsUnderAKilobyteWithTheLongestReasons) {
  OdometryResult result = trackedResult();
  result.reason = std::string(400, 'x');
  stereo_descriptor_vo::VoInfo info = toInfo(result, someMessage());
  info.header.frame_id = "robot/odom";
  EXPECT_LT(ros::serialization::serializationLength(info), 1000u);
}

TEST(ToFlow, LeadsFromThePreviousPositionToThePresentOne) {
  OdometryResult result = trackedResult();
  const StereoFeatures features = someFeatures();
  result.flow = {{10.f, 20.f, 5.f, 3, true}, {30.f, 40.f, 5.f, 0, false}};
  const stereo_descriptor_vo::FeatureFlow flow = toFlow(result, features);
  EXPECT_EQ(flow.u_reference, (std::vector<float>{10.f, 30.f}));
  EXPECT_EQ(flow.v_reference, (std::vector<float>{20.f, 40.f}));
  EXPECT_EQ(flow.u, (std::vector<float>{features.u[3], features.u[0]}));
  EXPECT_EQ(flow.v, (std::vector<float>{features.v[3], features.v[0]}));
  ASSERT_EQ(flow.inlier.size(), 2u);
  EXPECT_TRUE(flow.inlier[0]);
  EXPECT_FALSE(flow.inlier[1]);
}

}  // namespace sdvo::ros_conversions::test_vo_info
