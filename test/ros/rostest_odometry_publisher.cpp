#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_msgs/TFMessage.h>

#include "../../src/ros/publishers/odometry_publisher.hpp"
#include "message_samples.hpp"
#include "spin.hpp"

namespace sdvo::rostest_odometry_publisher {

using ros_conversions::trackedResult;

/// Keeps what comes on a topic.
template <class Message>
class Inbox {
 public:
  Inbox(ros::NodeHandle& nh, const std::string& topic)
      : subscriber_(nh.subscribe<Message>(
            topic, 100, [this](const boost::shared_ptr<const Message>& message) { messages.push_back(*message); })) {}

  bool isConnected() const { return subscriber_.getNumPublishers() > 0; }

  /// Waits for a message.
  bool comes() const {
    return spinUntil([this] { return !messages.empty(); });
  }

  std::vector<Message> messages;

 private:
  ros::Subscriber subscriber_;
};

class OdometryPublisherTest : public ::testing::Test {
 protected:
  void start(const OdometryOutputOptions& options) {
    publisher_ = std::make_unique<OdometryPublisher>(nh_, options, 1);
    odom_ = std::make_unique<Inbox<nav_msgs::Odometry>>(nh_, "odom");
    path_ = std::make_unique<Inbox<nav_msgs::Path>>(nh_, "path");
    info_ = std::make_unique<Inbox<stereo_descriptor_vo::VoInfo>>(nh_, "vo_info");
    tf_ = std::make_unique<Inbox<tf2_msgs::TFMessage>>(nh_, "/tf");
    ASSERT_TRUE(spinUntil([&] {
      return odom_->isConnected() && path_->isConnected() && info_->isConnected() &&
             (tf_->isConnected() || !options.publish_tf);
    }));
  }

  /// A result `step` m ahead of the origin, stamped as many tenths of a second later.
  static OdometryResult resultAt(int step) {
    OdometryResult result = trackedResult();
    result.stamp += step * 100000000ll;
    result.T_origin_camera.translation().z() = step;
    return result;
  }

  /// Publishes and waits for the information of this pair, which is the last to come.
  void publish(const OdometryResult& result) {
    const std::size_t odom = odom_->messages.size(), info = info_->messages.size();
    publisher_->publish(result, T_base_camera_);
    publisher_->publishInfo({}, ros::Time().fromNSec(static_cast<std::uint64_t>(result.stamp)));
    ASSERT_TRUE(spinUntil(
        [&] { return info_->messages.size() > info && (!result.has_pose || odom_->messages.size() > odom); }));
  }

  ros::NodeHandle global_nh_, nh_{"/odometry_publisher"};
  Eigen::Isometry3d T_base_camera_ = Eigen::Isometry3d::Identity();
  std::unique_ptr<OdometryPublisher> publisher_;
  std::unique_ptr<Inbox<nav_msgs::Odometry>> odom_;
  std::unique_ptr<Inbox<nav_msgs::Path>> path_;
  std::unique_ptr<Inbox<stereo_descriptor_vo::VoInfo>> info_;
  std::unique_ptr<Inbox<tf2_msgs::TFMessage>> tf_;
};

TEST_F(OdometryPublisherTest, OdometryPoseTransformAndPathSayTheSame) {
  Inbox<geometry_msgs::PoseWithCovarianceStamped> poses(nh_, "pose");
  start({});
  ASSERT_TRUE(spinUntil([&] { return poses.isConnected(); }));
  publish(resultAt(2));
  ASSERT_TRUE(tf_->comes() && path_->comes() && poses.comes());
  EXPECT_EQ(poses.messages[0].pose.pose.position.z, 2.0);
  EXPECT_EQ(poses.messages[0].pose.covariance, odom_->messages[0].pose.covariance);
  const geometry_msgs::TransformStamped& transform = tf_->messages.at(0).transforms.at(0);
  EXPECT_EQ(odom_->messages[0].pose.pose.position.z, 2.0);
  EXPECT_EQ(transform.transform.translation.z, 2.0);
  EXPECT_EQ(transform.header.frame_id, "odom");
  EXPECT_EQ(transform.child_frame_id, "base_link");
  EXPECT_EQ(path_->messages[0].poses.at(0).pose.position.z, 2.0);
  for (const std_msgs::Header& header : {odom_->messages[0].header, poses.messages[0].header, transform.header,
                                         path_->messages[0].header, info_->messages[0].header}) {
    EXPECT_EQ(header.stamp.toNSec(), 1000000000300000007u);
    EXPECT_EQ(header.frame_id, "odom");
  }
}

/// To a millimetre, wherever on earth odom begins.
TEST_F(OdometryPublisherTest, MapPointsAreInTheCamerasFrame) {
  Inbox<sensor_msgs::PointCloud2> clouds(nh_, "map_points");
  start({});
  ASSERT_TRUE(spinUntil([&] { return clouds.isConnected() && publisher_->wantsMap(); }));
  Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();
  T_origin_camera.linear() << 0, 0, 1, 0, 1, 0, -1, 0, 0;  // turned to the right
  T_origin_camera.translation() << 1.0, 0.0, 2.0;
  std_msgs::Header header;
  header.frame_id = "left_optical";
  header.stamp = ros::Time(7);
  publisher_->restart(Eigen::Isometry3d(Eigen::Translation3d(500000.25, 5400000.5, 100.0)));
  publisher_->publishMap({{4.001, 2.0, 3.0}}, T_origin_camera, header);
  ASSERT_TRUE(clouds.comes());
  const sensor_msgs::PointCloud2& cloud = clouds.messages[0];
  EXPECT_EQ(cloud.header.frame_id, "left_optical");
  EXPECT_EQ(cloud.header.stamp, ros::Time(7));
  ASSERT_EQ(cloud.width * cloud.height, 1u);
  sensor_msgs::PointCloud2ConstIterator<float> point(cloud, "x");
  EXPECT_FLOAT_EQ(point[0], -1.0f);
  EXPECT_FLOAT_EQ(point[1], 2.0f);
  EXPECT_FLOAT_EQ(point[2], 3.001f);
}

TEST_F(OdometryPublisherTest, WhileLostZerosAreThereWhereTheyAreAskedFor) {
  OdometryOutputOptions options;
  options.publish_null_when_lost = true;
  start(options);
  OdometryResult lost = resultAt(1), waiting = resultAt(2);
  lost.has_pose = waiting.has_pose = false;
  lost.state = TrackingState::kLost;
  waiting.state = TrackingState::kWaiting;
  publish(waiting);
  publish(lost);
  publish(resultAt(3));
  ASSERT_TRUE(spinUntil([&] { return odom_->messages.size() == 2; }));
  const nav_msgs::Odometry& null = odom_->messages[0];
  EXPECT_EQ(null.header.stamp.toNSec(), 1000000000200000007u);
  EXPECT_EQ(null.pose.pose.orientation.w, 0.0);
  EXPECT_EQ(null.pose.covariance[0], 9999.0);
  EXPECT_EQ(null.twist.covariance[35], 9999.0);
  ASSERT_TRUE(tf_->comes());
  EXPECT_EQ(tf_->messages.size(), 1u) << "none of the zeros";
}

TEST_F(OdometryPublisherTest, TransformsGoWhereTheNodeHasThemRemapped) {
  nh_ = ros::NodeHandle("/odometry_publisher", {{"/tf", "/robot/tf"}});
  Inbox<tf2_msgs::TFMessage> process_tf(global_nh_, "/tf");
  start({});
  publish(resultAt(2));
  ASSERT_TRUE(tf_->comes());
  EXPECT_FALSE(process_tf.isConnected()) << "nobody announces transforms there";
}

TEST_F(OdometryPublisherTest, WithoutAPoseThereIsNeitherOdometryNorPath) {
  start({});
  OdometryResult lost = resultAt(1);
  lost.has_pose = false;
  publish(lost);
  publish(resultAt(2));
  ASSERT_TRUE(path_->comes());
  EXPECT_EQ(odom_->messages.size(), 1u);
  EXPECT_EQ(path_->messages.size(), 1u);
  EXPECT_EQ(path_->messages[0].poses.size(), 1u);
}

TEST_F(OdometryPublisherTest, FramesAndTransformAsConfigured) {
  OdometryOutputOptions options;
  options.odom_frame_id = "/world";
  options.base_frame_id = "robot";
  options.invert_tf = true;
  start(options);
  publish(resultAt(3));
  ASSERT_TRUE(tf_->comes());
  EXPECT_EQ(odom_->messages[0].header.frame_id, "world");
  EXPECT_EQ(odom_->messages[0].child_frame_id, "robot");
  const geometry_msgs::TransformStamped& transform = tf_->messages[0].transforms.at(0);
  EXPECT_EQ(transform.header.frame_id, "robot");
  EXPECT_EQ(transform.child_frame_id, "world");
  EXPECT_EQ(transform.transform.translation.z, -3.0);
}

TEST_F(OdometryPublisherTest, NoTransformWhereAFilterPublishesIt) {
  OdometryOutputOptions options;
  options.publish_tf = false;
  start(options);
  for (int i = 0; i < 5; ++i) publish(resultAt(i));
  EXPECT_TRUE(tf_->messages.empty());
}

TEST_F(OdometryPublisherTest, ThePathKeepsItsNewestPoses) {
  start({});
  constexpr int kPoses = OdometryPublisher::kLongestPath + 2;
  for (int i = 0; i < kPoses; ++i) publish(resultAt(i));
  const auto poses = publisher_->path().poses;
  ASSERT_EQ(poses.size(), OdometryPublisher::kLongestPath);
  EXPECT_EQ(poses.front().pose.position.z, 2.0);
  EXPECT_EQ(poses.back().pose.position.z, kPoses - 1.0);
}

TEST_F(OdometryPublisherTest, APoseThatIsSetLeavesThePathOfBefore) {
  start({});
  publish(resultAt(7));
  publisher_->moveTo(Eigen::Isometry3d(Eigen::Translation3d(100.0, 0.0, 0.0)));
  publish(resultAt(8));
  const auto poses = publisher_->path().poses;
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].pose.position.z, 7.0);
  EXPECT_EQ(poses[1].pose.position.x, 100.0);
}

TEST_F(OdometryPublisherTest, WhoeverSubscribesLateGetsThePath) {
  start({});
  publish(resultAt(1));
  ASSERT_TRUE(path_->comes());
  path_.reset();
  path_ = std::make_unique<Inbox<nav_msgs::Path>>(nh_, "path");
  ASSERT_TRUE(path_->comes());
  EXPECT_EQ(path_->messages[0].poses.size(), 1u);
}

TEST_F(OdometryPublisherTest, StartsAgainFromAnyPlaceWithANewPath) {
  start({});
  publish(resultAt(1));
  publisher_->restart(Eigen::Translation3d(10.0, 20.0, 30.0) * Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitX()));
  publish(resultAt(2));  // 2 m along z, which is -y of odom now
  const geometry_msgs::Pose& pose = odom_->messages.at(1).pose.pose;
  EXPECT_NEAR(pose.position.x, 10.0, 1e-9);
  EXPECT_NEAR(pose.position.y, 18.0, 1e-9);
  EXPECT_NEAR(pose.position.z, 30.0, 1e-9);
  EXPECT_NEAR(pose.orientation.x, std::sqrt(0.5), 1e-9);
  EXPECT_EQ(publisher_->path().poses.size(), 1u);
}

TEST_F(OdometryPublisherTest, ErrorsWaitForTheTruth) {
  OdometryOutputOptions options;
  options.ground_truth_frame_id = "world";
  start(options);
  const Inbox<geometry_msgs::PoseStamped> errors(nh_, "ground_truth_error");
  ASSERT_TRUE(spinUntil([&] { return errors.isConnected(); }));
  publish(resultAt(1));
  publish(resultAt(2));
  publisher_->publishErrors([](const ros::Time&) { return std::optional<Eigen::Isometry3d>(); });
  const Eigen::Isometry3d T_odom_true(Eigen::Translation3d(0.5, 0.0, 0.0) *
                                      Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitZ()));
  publisher_->publishErrors([&](const ros::Time&) { return std::optional(T_odom_true); });
  ASSERT_TRUE(spinUntil([&] { return errors.messages.size() == 2; }));
  for (const std::size_t i : {0u, 1u}) {
    const geometry_msgs::Point &found = odom_->messages.at(i).pose.pose.position,
                               &error = errors.messages[i].pose.position;
    EXPECT_EQ(errors.messages[i].header.stamp, odom_->messages[i].header.stamp);
    EXPECT_EQ(errors.messages[i].header.frame_id, "base_link");
    EXPECT_NEAR(error.x, found.y, 1e-9);  // the true base looks along y
    EXPECT_NEAR(error.y, 0.5 - found.x, 1e-9);
    EXPECT_NEAR(error.z, found.z, 1e-9);
  }
}

TEST_F(OdometryPublisherTest, InfoTellsLatencyAndSession) {
  start({});
  const ros::Time stamp = ros::Time::now() - ros::Duration(2.0);
  const stereo_descriptor_vo::VoInfo published = publisher_->publishInfo({}, stamp);
  ASSERT_TRUE(info_->comes());
  EXPECT_EQ(info_->messages[0].header.stamp, stamp);
  EXPECT_NEAR(published.latency, 2.0, 0.5);
  EXPECT_EQ(info_->messages[0].latency, published.latency);
  const OdometryPublisher other(nh_, {}, 2);
  EXPECT_FALSE(published.session.isZero());
  EXPECT_NE(OdometryPublisher(nh_, {}, 3).publishInfo({}, stamp).session, published.session);
  // Stamps that are wildly wrong have a latency too.
  EXPECT_GT(publisher_->publishInfo({}, ros::Time(0, 1)).latency, 1e9f);
  EXPECT_LT(publisher_->publishInfo({}, ros::Time(0xffffffffu, 0)).latency, -1e9f);
}

}  // namespace sdvo::rostest_odometry_publisher
