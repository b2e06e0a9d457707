#include <gtest/gtest.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <optional>

#include "../../src/ros/transforms/start_pose.hpp"
#include "../said.hpp"
#include "spin.hpp"

namespace sdvo::rostest_start_pose {

class StartPoseTest : public ::testing::Test {
 protected:
  StartPoseTest() : transforms_(nh_, std::nullopt, 0, [](const std::string&) {}) {
    options_.initial_pose = "1 0 0 0 0 0";
  }

  void start() {
    start_.emplace(
        options_, transforms_, nullptr, [this](const Eigen::Isometry3d& T) { placed_at_ = T.translation().x(); },
        [](const std::string&) {});
  }

  ros::NodeHandle nh_;
  RobotTransforms transforms_;
  OdometryOutputOptions options_;
  std::optional<StartPose> start_;
  double placed_at_ = 0.0;
};

TEST_F(StartPoseTest, AGivenPoseHoldsUntilTheNextRestart) {
  start();
  EXPECT_EQ(placed_at_, 1.0);
  EXPECT_EQ(start_->find(ros::Time(1)), "");
  start_->restart(Eigen::Isometry3d(Eigen::Translation3d(5.0, 0.0, 0.0)));
  EXPECT_EQ(placed_at_, 5.0);
  start_->restart();
  EXPECT_EQ(placed_at_, 1.0);
}

TEST_F(StartPoseTest, WaitsForTheTruthUnlessAPoseIsGiven) {
  options_.ground_truth_frame_id = "world";
  options_.ground_truth_base_frame_id = "true_base";
  start();
  EXPECT_TRUE(contains(start_->find(ros::Time(10)), "ground_truth_frame_id"));
  start_->give();
  EXPECT_EQ(start_->find(ros::Time(10)), "");
  start_->restart();
  ros::Publisher tf = nh_.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
  tf2_msgs::TFMessage message;
  message.transforms.emplace_back();
  message.transforms[0].header.frame_id = "world";
  message.transforms[0].child_frame_id = "true_base";
  message.transforms[0].transform.translation.x = 3.0;
  message.transforms[0].transform.rotation.w = 1.0;
  tf.publish(message);
  EXPECT_TRUE(spinUntil([&] { return start_->find(ros::Time(10)).empty(); }));
  EXPECT_EQ(placed_at_, 3.0);
}

TEST_F(StartPoseTest, ABaseThatIsTheCameraHasOpticalAxes) {
  start();
  start_->turnToOptical();
  EXPECT_TRUE((start_->T_odom_base().linear() * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX()));
  EXPECT_EQ(placed_at_, 1.0);
}

}  // namespace sdvo::rostest_start_pose
