#include <gtest/gtest.h>
#include <message_filters/pass_through.h>
#include <message_filters/time_synchronizer.h>
#include <sensor_msgs/CameraInfo.h>

#include <boost/make_shared.hpp>
#include <memory>

#include "../../src/ros/stamps.hpp"
#include "../../src/ros/waiting_stamps.hpp"

namespace sdvo {
namespace {

using Message = sensor_msgs::CameraInfo;

constexpr int kRoom = 4;

/// Two topics behind ROS's own synchroniser.
class WaitingStampsTest : public ::testing::Test {
 protected:
  WaitingStampsTest() {
    ros::Time::init();
    synchronise();
  }

  void synchronise() {
    synchroniser_ = std::make_unique<message_filters::TimeSynchronizer<Message, Message>>(first_, second_, kRoom);
    synchroniser_->registerCallback(&WaitingStampsTest::onPair, this);
  }

  void onPair(const Message::ConstPtr& message, const Message::ConstPtr&) {
    ++pairs_;
    waiting_.complete(nanoseconds(message->header.stamp));
  }

  /// Whether the stamp was found to be shut out.
  bool add(message_filters::PassThrough<Message>& topic, double stamp) {
    const auto message = boost::make_shared<Message>();
    message->header.stamp = ros::Time(stamp);
    const bool shut_out = waiting_.shutOut(nanoseconds(message->header.stamp));
    if (shut_out && mended_) synchronise();
    topic.add(message);
    return shut_out;
  }

  /// How many pairs come of so many messages on both topics, a tenth of a second apart.
  int play(double begin, int count, double delay = 0.0) {
    pairs_ = 0;
    for (int i = 0; i < count; ++i) {
      add(first_, begin + 0.1 * i);
      add(second_, begin - delay + 0.1 * i);
    }
    return pairs_;
  }

  message_filters::PassThrough<Message> first_, second_;
  std::unique_ptr<message_filters::TimeSynchronizer<Message, Message>> synchroniser_;
  WaitingStamps waiting_{kRoom};
  int pairs_ = 0;
  bool mended_ = true;
};

TEST_F(WaitingStampsTest, WithoutThemTheFutureShutsOutThePresentForGood) {
  mended_ = false;
  for (int i = 0; i < kRoom; ++i) add(first_, 5000.0 + i);
  EXPECT_EQ(play(100.0, 50), 0);
}

TEST_F(WaitingStampsTest, TheFutureShutsNothingOut) {
  for (int i = 0; i < kRoom; ++i) EXPECT_FALSE(add(first_, 5000.0 + i));
  EXPECT_EQ(play(100.0, 50), 50);
}

TEST_F(WaitingStampsTest, FewOfTheFutureAreLeftWhereTheyAre) {
  for (int i = 0; i < kRoom - 1; ++i) add(first_, 5000.0 + i);
  for (int i = 0; i < 50; ++i) {
    EXPECT_FALSE(add(first_, 100.0 + 0.1 * i));
    EXPECT_FALSE(add(second_, 100.0 + 0.1 * i));
  }
  EXPECT_EQ(pairs_, 50);
}

TEST_F(WaitingStampsTest, WhatOneSideLeftOverDoesNotOutliveAJumpBack) {
  EXPECT_EQ(play(100.0, 20), 20);
  for (int i = 20; i < 40; ++i) EXPECT_FALSE(add(first_, 100.0 + 0.1 * i));
  EXPECT_EQ(play(100.0, 20), 20);
}

TEST_F(WaitingStampsTest, ASideThatIsLateShutsNothingOut) {
  EXPECT_EQ(play(100.0, 50, 0.3), 47) << "within the room";
  for (int i = 0; i < 50; ++i) {
    EXPECT_FALSE(add(first_, 200.0 + 0.1 * i));
    EXPECT_FALSE(add(second_, 199.1 + 0.1 * i)) << "0.9 s late";
  }
}

}  // namespace
}  // namespace sdvo
