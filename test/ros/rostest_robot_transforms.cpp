#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <cstdint>
#include <optional>

#include "../../src/ros/transforms/camera_mount.hpp"
#include "../said.hpp"
#include "spin.hpp"

namespace sdvo::rostest_robot_transforms {

geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child, const ros::Time& stamp,
                                          double x = 0.0) {
  geometry_msgs::TransformStamped message;
  message.header.frame_id = parent;
  message.header.stamp = stamp;
  message.child_frame_id = child;
  message.transform.translation.x = x;
  message.transform.rotation.w = 1.0;
  return message;
}

geometry_msgs::TransformStamped turned(geometry_msgs::TransformStamped message, double yaw) {
  message.transform.rotation.z = std::sin(0.5 * yaw);
  message.transform.rotation.w = std::cos(0.5 * yaw);
  return message;
}

class RobotTransformsTest : public ::testing::Test {
 protected:
  RobotTransformsTest()
      : tf_(nh_.advertise<tf2_msgs::TFMessage>("/tf", 100)),
        tf_static_(nh_.advertise<tf2_msgs::TFMessage>("/tf_static", 100)) {}

  void start(std::optional<ros_conversions::OdometryFrames> ours = std::nullopt) {
    transforms_.emplace(nh_, std::move(ours), kTag, [this](const std::string& what) { warnings_.push_back(what); });
    ASSERT_TRUE(spinUntil([&] { return tf_.getNumSubscribers() > 0 && tf_static_.getNumSubscribers() > 0; }));
  }

  void send(ros::Publisher& publisher, const std::vector<geometry_msgs::TransformStamped>& transforms) {
    tf2_msgs::TFMessage message;
    message.transforms = transforms;
    publisher.publish(message);
  }

  /// When this comes, all that was sent on the topic before has come.
  void waitForMarker(ros::Publisher& publisher) {
    const std::string child = "marker_" + std::to_string(++markers_);
    send(publisher, {transform("markers", child, ros::Time::now())});
    std::string problem;
    ASSERT_TRUE(spinUntil([&] { return transforms_->find("markers", child, problem).has_value(); })) << problem;
  }

  void expectOneWarning(const std::vector<std::string>& words) const {
    ASSERT_EQ(warnings_.size(), 1u);
    expectWords(warnings_[0], words);
  }

  static constexpr std::uint32_t kTag = 7;

  /// As TransformPublisher sends it.
  static geometry_msgs::TransformStamped tagged(geometry_msgs::TransformStamped message, std::uint32_t tag) {
    message.header.seq = tag;
    return message;
  }

  ros::NodeHandle nh_;
  ros::Publisher tf_, tf_static_;
  std::optional<RobotTransforms> transforms_;
  std::vector<std::string> warnings_;
  int markers_ = 0;
};

TEST_F(RobotTransformsTest, TheMissingLinkIsNamedWithACommandThatPublishesIt) {
  start();
  const std::string alone = transforms_->explainMissing("base_link", "left_optical");
  expectWords(alone, {"'left_optical' to base frame 'base_link'", "the link base_link -> left_optical is missing",
                      "no 'base_link'", "static_transform_publisher 0 0 0 -0.5 0.5 -0.5 0.5 base_link left_optical",
                      "base_frame_id:=left_optical"});
  EXPECT_FALSE(contains(alone, "mount_rpy")) << "not every launch file has it";
  send(tf_static_, {transform("oak_base", "oak_body", ros::Time()), transform("oak_body", "oak_left", ros::Time())});
  waitForMarker(tf_static_);
  expectWords(transforms_->explainMissing("base_link", "oak_left"),
              {"the link base_link -> oak_base is missing", "'oak_left' below 'oak_base'",
               "static_transform_publisher 0 0 0 0 0 0 base_link oak_base", "base_frame_id:=oak_base"});
  send(tf_static_, {transform("base_link", "camera_link", ros::Time()), transform("base_link", "laser", ros::Time())});
  waitForMarker(tf_static_);
  const std::string of_driver = transforms_->explainMissing("base_link", "camera_infra1_optical_frame");
  expectWords(of_driver, {"the link camera_link -> camera_infra1_optical_frame is missing"});
  EXPECT_FALSE(contains(of_driver, "base_frame_id")) << "a robot is there";
  send(tf_, {transform("odom", "oak_base", ros::Time::now())});
  waitForMarker(tf_);
  expectWords(transforms_->explainMissing("base_link", "oak_left"),
              {"below 'oak_body', 'oak_base', 'odom': set base_frame_id to the robot's own one"});
  EXPECT_TRUE(contains(transforms_->explainMissing("base_link", ""), "no frame_id"));
}

TEST_F(RobotTransformsTest, AStampFarAheadIsLeftOutAndNamedAndThePresentStays) {
  start();
  std::string problem;
  const ros::Time now = ros::Time::now();
  send(tf_, {transform("wheels", "base", now + ros::Duration(3600.0))});
  send(tf_, {transform("wheels", "base", now, 1.0), transform("wheels", "base", now + ros::Duration(0.1), 2.0)});
  waitForMarker(tf_);
  expectOneWarning({"wheels -> base", "3600", "ahead of this machine's clock"});
  EXPECT_TRUE(transforms_->findMotion("wheels", "base", now, now + ros::Duration(0.1), problem)) << problem;
}

TEST_F(RobotTransformsTest, WhatIsBeyondTheEarthIsNoMount) {
  start();
  send(tf_static_, {transform("base_link", "camera", ros::Time(), 1e30)});
  waitForMarker(tf_static_);
  std::string problem;
  EXPECT_FALSE(transforms_->find("base_link", "camera", problem));
  expectWords(problem, {"'camera' beyond 1e8 m of 'base_link'"});
}

TEST_F(RobotTransformsTest, TheCamerasPlaceIsReadOnceAndAgainWhenItIsForgotten) {
  start();
  CameraMount mount(*transforms_, 0.0);
  std::string problem;
  const auto place = [&] {
    const auto found = mount.find("base_link", "camera", problem);
    return found ? found->translation().x() : std::nan("");
  };
  const auto isKnownAt = [&](double x) {
    return spinUntil([&] {
      const auto known = transforms_->find("base_link", "camera", problem);
      return known && known->translation().x() == x;
    });
  };
  send(tf_static_, {transform("base_link", "camera", ros::Time::now(), 1.0)});
  ASSERT_TRUE(isKnownAt(1.0));
  EXPECT_EQ(place(), 1.0);
  send(tf_static_, {transform("base_link", "camera", ros::Time::now(), 2.0)});
  ASSERT_TRUE(isKnownAt(2.0));
  EXPECT_EQ(place(), 1.0);
  mount.forget();
  EXPECT_EQ(mount.last()->translation().x(), 1.0) << "for who reads it meanwhile";
  EXPECT_EQ(place(), 2.0);
}

TEST_F(RobotTransformsTest, TellsHowAFrameMovedBetweenTwoTimes) {
  start();
  const ros::Time from = ros::Time::now(), to = from + ros::Duration(0.1);
  std::string problem;
  send(tf_, {turned(transform("wheels", "base", from, 5.0), 0.3)});
  waitForMarker(tf_);
  EXPECT_FALSE(transforms_->findMotion("wheels", "base", from, to, problem));
  EXPECT_FALSE(problem.empty());
  send(tf_, {turned(transform("wheels", "base", from + ros::Duration(0.2), 7.0), 0.3)});
  waitForMarker(tf_);
  const auto motion = transforms_->findMotion("wheels", "base", from, to, problem);
  ASSERT_TRUE(motion) << problem;
  const Eigen::Vector3d expected(std::cos(0.3), -std::sin(0.3), 0.0);  // half of 2 m along x of the wheels' frame
  EXPECT_LT((motion->translation() - expected).norm(), 1e-6) << motion->translation().transpose();
  EXPECT_TRUE(motion->linear().isIdentity(1e-6));
}

TEST_F(RobotTransformsTest, ChainsStaticAndMovingTransforms) {
  start();
  std::string problem;
  EXPECT_FALSE(transforms_->find("base", "camera", problem));
  EXPECT_TRUE(contains(problem, "base")) << problem;
  send(tf_static_, {transform("base", "mast", ros::Time(), 1.0)});
  send(tf_, {transform("mast", "camera", ros::Time::now(), 2.0)});
  ASSERT_TRUE(spinUntil([&] { return transforms_->find("base", "camera", problem).has_value(); }));
  EXPECT_EQ(transforms_->find("base", "camera", problem)->translation().x(), 3.0);
}

TEST_F(RobotTransformsTest, WildStampsAndFramesAreLeftOutAndNothingElse) {
  start();
  for (const std::uint32_t seconds : {0u, 1u << 31, 0xffffffffu, 1u, 0x7fffffffu}) {
    send(tf_, {transform("base", "camera", ros::Time(seconds, 999999999u)), transform("", "camera", ros::Time::now()),
               transform("base", "base", ros::Time::now())});
    send(tf_static_, {transform("base", "mast", ros::Time(seconds, 999999999u))});
  }
  waitForMarker(tf_);
  waitForMarker(tf_static_);
}

TEST_F(RobotTransformsTest, AnotherPublisherOfOurChildIsNamed) {
  start(ros_conversions::OdometryFrames{"odom", "base_link"});
  send(tf_, {tagged(transform("odom", "base_link", ros::Time::now()), kTag)});  // our own
  waitForMarker(tf_);
  EXPECT_TRUE(warnings_.empty());
  for (int i = 0; i < 3; ++i) send(tf_, {transform("world", "base_link", ros::Time::now())});
  waitForMarker(tf_);
  expectOneWarning({ros::this_node::getName() + " publishes world -> base_link",
                    ros::this_node::getName() + " publishes odom -> base_link"});
}

/// On TF the nodelets of one process have one name.
TEST_F(RobotTransformsTest, AnotherNodeletOfTheProcessThatPublishesTheSameIsNamed) {
  start(ros_conversions::OdometryFrames{"odom", "base_link"});
  for (int i = 0; i < 3; ++i) {
    const auto same = transform("odom", "base_link", ros::Time::now() + ros::Duration(0.1 * i));
    send(tf_, {tagged(same, kTag), tagged(same, kTag + 1)});
  }
  waitForMarker(tf_);
  expectOneWarning({"another nodelet of " + ros::this_node::getName(), "set publish_tf to false in one of them"});
}

TEST_F(RobotTransformsTest, TheCamerasPlaceIsAwaitedOnceAndNotWhenItIsUrgent) {
  start();
  CameraMount mount(*transforms_, 60.0);
  const ros::WallTime begin = ros::WallTime::now();
  int asked = 0;
  mount.await("base_link", "camera", [&] { return ++asked == 3; });
  EXPECT_EQ(asked, 3);
  send(tf_static_, {transform("base_link", "camera", ros::Time::now())});
  std::string problem;
  ASSERT_TRUE(spinUntil([&] { return transforms_->find("base_link", "camera", problem).has_value(); }));
  mount.await("base_link", "camera", [] { return false; });
  EXPECT_TRUE(mount.find("base_link", "camera", problem));
  EXPECT_LT((ros::WallTime::now() - begin).toSec(), 30.0);
}

/// As on a TurtleBot.
TEST_F(RobotTransformsTest, ARobotsOwnFrameAboveTheBaseIsNamedAsTheOneToMove) {
  start(ros_conversions::OdometryFrames{"odom", "base_link"});
  send(tf_static_, {transform("base_footprint", "base_link", ros::Time::now())});
  waitForMarker(tf_static_);
  send(tf_, {tagged(transform("odom", "base_link", ros::Time::now() + ros::Duration(1.0)), kTag)});
  waitForMarker(tf_);
  expectOneWarning({"set base_frame_id:=base_footprint (or invert_tf)"});
}

TEST_F(RobotTransformsTest, ACycleIsNamed) {
  start(ros_conversions::OdometryFrames{"odom", "base_link"});
  send(tf_, {transform("map", "odom", ros::Time::now()), transform("base_link", "camera", ros::Time::now())});
  waitForMarker(tf_);
  EXPECT_TRUE(warnings_.empty());
  send(tf_, {transform("camera", "map", ros::Time::now())});
  waitForMarker(tf_);
  expectOneWarning({"publishes camera -> map", "a cycle"});
}

TEST_F(RobotTransformsTest, ATransformMayBeClaimedLater) {
  start();
  transforms_->setOwnFrames({"map", "odom"});
  send(tf_, {transform("site", "odom", ros::Time::now())});
  waitForMarker(tf_);
  expectOneWarning({ros::this_node::getName() + " publishes map -> odom"});
}

TEST_F(RobotTransformsTest, WithoutATransformOfOursThereIsNoContention) {
  start();
  send(tf_, {transform("world", "base_link", ros::Time::now()), transform("base_link", "world", ros::Time::now())});
  waitForMarker(tf_);
  EXPECT_TRUE(warnings_.empty());
}

}  // namespace sdvo::rostest_robot_transforms
