#include <gtest/gtest.h>
#include <ros/ros.h>
#include <std_msgs/Int32.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>

#include "../../src/ros/node/threads.hpp"
#include "spin.hpp"

namespace sdvo::rostest_callback_thread {

std_msgs::Int32 message(int data) {
  std_msgs::Int32 message;
  message.data = data;
  return message;
}

/// Another subscriber of the same topic, on the global queue: a message that it got has come to all in this process.
class Witness {
 public:
  Witness(ros::NodeHandle& nh, const std::string& topic)
      : subscriber_(nh.subscribe<std_msgs::Int32>(topic, 100,
                                                  [this](const std_msgs::Int32::ConstPtr& m) { last_ = m->data; })) {}

  bool gets(int data) {
    return spinUntil([&] { return last_ == data; });
  }

 private:
  int last_ = -1;
  ros::Subscriber subscriber_;
};

/// What the threads that all nodelets share are to us here: nobody serves the global queue.
TEST(CallbackThread, NeedsNobodyElsesThreads) {
  std::atomic<int> last{0};
  std::atomic<std::size_t> thread{0};
  ros::NodeHandle nh;
  ros::Publisher publisher = nh.advertise<std_msgs::Int32>("numbers", 100);
  CallbackThread callbacks;
  ros::NodeHandle served = callbacks.serve(nh);
  const boost::function<void(const std_msgs::Int32::ConstPtr&)> receive = [&](const std_msgs::Int32::ConstPtr& m) {
    last = m->data;
    thread = std::hash<std::thread::id>()(std::this_thread::get_id());
  };
  ros::Subscriber subscriber = served.subscribe<std_msgs::Int32>("numbers", 100, receive);
  Witness witness(nh, "numbers");
  ASSERT_TRUE(waitUntil([&] { return publisher.getNumSubscribers() > 0; }));
  publisher.publish(message(1));
  ASSERT_TRUE(witness.gets(1));
  EXPECT_EQ(last, 0) << "called before start()";
  callbacks.start();
  EXPECT_TRUE(waitUntil([&] { return last == 1; }));
  EXPECT_NE(thread, std::hash<std::thread::id>()(std::this_thread::get_id()));
  publisher.publish(message(2));
  EXPECT_TRUE(waitUntil([&] { return last == 2; }));
}

TEST(CallbackThread, AfterStopNoCallbackRuns) {
  std::atomic<bool> is_running{false}, may_run{true}, ran_late{false};
  std::atomic<int> calls{0};
  ros::NodeHandle nh;
  ros::Publisher publisher = nh.advertise<std_msgs::Int32>("more_numbers", 100);
  CallbackThread callbacks;
  ros::NodeHandle served = callbacks.serve(nh);
  const boost::function<void(const std_msgs::Int32::ConstPtr&)> receive = [&](const std_msgs::Int32::ConstPtr&) {
    is_running = true;
    ++calls;
    ros::WallDuration(0.05).sleep();
    if (!may_run) ran_late = true;
    is_running = false;
  };
  ros::Subscriber subscriber = served.subscribe<std_msgs::Int32>("more_numbers", 100, receive);
  Witness witness(nh, "more_numbers");
  callbacks.start();
  ASSERT_TRUE(waitUntil([&] { return publisher.getNumSubscribers() > 0; }));
  for (int i = 0; i < 20; ++i) publisher.publish(message(i));
  ASSERT_TRUE(waitUntil([&] { return is_running.load(); }));
  callbacks.stop();
  may_run = false;
  const int calls_then = calls;
  EXPECT_FALSE(is_running);
  publisher.publish(message(99));
  ASSERT_TRUE(witness.gets(99));
  EXPECT_EQ(calls, calls_then);
  EXPECT_FALSE(ran_late);
}

TEST(CallbackThread, WhatACallbackThrowsEndsThatCallAlone) {
  std::atomic<int> last{0};
  ros::NodeHandle nh;
  ros::Publisher publisher = nh.advertise<std_msgs::Int32>("bad_numbers", 100);
  CallbackThread callbacks;
  ros::NodeHandle served = callbacks.serve(nh);
  const boost::function<void(const std_msgs::Int32::ConstPtr&)> receive = [&](const std_msgs::Int32::ConstPtr& m) {
    if (m->data % 2 == 0) throw std::runtime_error("an even number");
    last = m->data;
  };
  ros::Subscriber subscriber = served.subscribe<std_msgs::Int32>("bad_numbers", 100, receive);
  callbacks.start();
  ASSERT_TRUE(waitUntil([&] { return publisher.getNumSubscribers() > 0; }));
  for (int i = 1; i <= 5; ++i) publisher.publish(message(i));
  EXPECT_TRUE(waitUntil([&] { return last == 5; }));
}

}  // namespace sdvo::rostest_callback_thread
