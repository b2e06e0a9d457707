#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <boost/make_shared.hpp>
#include <vector>

#include "../../src/ros/exact_synchroniser.hpp"

namespace sdvo {
namespace test_exact_synchroniser {

using sensor_msgs::CameraInfo;
using sensor_msgs::Image;

class ExactSynchroniserTest : public ::testing::Test {
 protected:
  static constexpr int kRoom = 4;

  ExactSynchroniserTest() { ros::Time::init(); }

  template <class Message>
  static boost::shared_ptr<const Message> at(double stamp) {
    const auto message = boost::make_shared<Message>();
    message->header.stamp = ros::Time(stamp);
    return message;
  }

  void addBoth(double stamp) {
    synchroniser_.add<0>(at<Image>(stamp));
    synchroniser_.add<1>(at<CameraInfo>(stamp));
  }

  std::vector<double> sets_;
  int without_info_ = 0, without_image_ = 0;
  ExactSynchroniser<Image, CameraInfo> synchroniser_{
      kRoom,
      [this](const Image::ConstPtr& image, const CameraInfo::ConstPtr& info) {
        EXPECT_EQ(image->header.stamp, info->header.stamp);
        sets_.push_back(image->header.stamp.toSec());
      },
      [this](const Image::ConstPtr& image, const CameraInfo::ConstPtr& info) {
        without_info_ += image && !info;
        without_image_ += info && !image;
      }};
};

TEST_F(ExactSynchroniserTest, WhatHasOneStampIsASet) {
  addBoth(1.0);
  synchroniser_.add<0>(at<Image>(2.0));
  EXPECT_EQ(sets_, (std::vector<double>{1.0}));
  addBoth(3.0);
  EXPECT_EQ(sets_, (std::vector<double>{1.0, 3.0}));
  EXPECT_EQ(without_info_, 1) << "the image at 2 s";
  EXPECT_EQ(without_image_, 0);
}

TEST_F(ExactSynchroniserTest, WhatOneInputLeftOverDoesNotOutliveAJumpBack) {
  for (int i = 0; i < 2 * kRoom; ++i) synchroniser_.add<0>(at<Image>(100.0 + i));
  for (int i = 0; i < 3; ++i) addBoth(10.0 + i);
  EXPECT_EQ(sets_, (std::vector<double>{10.0, 11.0, 12.0}));
}

TEST_F(ExactSynchroniserTest, TheFutureShutsNothingOut) {
  for (int i = 0; i < 2 * kRoom; ++i) synchroniser_.add<0>(at<Image>(5000.0 + i));
  for (int i = 0; i < 50; ++i) addBoth(100.0 + i);
  EXPECT_EQ(sets_.size(), 50u);
  EXPECT_EQ(without_info_, 2 * kRoom);
}

TEST_F(ExactSynchroniserTest, ASetOfTheFutureTakesNothingFromThoseThatCameAfterIt) {
  synchroniser_.add<0>(at<Image>(5000.0));
  synchroniser_.add<0>(at<Image>(1.0));
  synchroniser_.add<1>(at<CameraInfo>(5000.0));
  synchroniser_.add<1>(at<CameraInfo>(1.0));
  EXPECT_EQ(sets_, (std::vector<double>{5000.0, 1.0}));
  EXPECT_EQ(without_info_ + without_image_, 0);
}

TEST_F(ExactSynchroniserTest, WhatComesTooLateTakesNothingFromTheRest) {
  for (int i = 0; i < 10; ++i) synchroniser_.add<0>(at<Image>(1.0 + i));
  EXPECT_EQ(without_info_, 10 - kRoom);
  for (int i = 0; i < 10; ++i) synchroniser_.add<1>(at<CameraInfo>(1.0 + i));
  EXPECT_EQ(sets_, (std::vector<double>{7.0, 8.0, 9.0, 10.0})) << "the images that wait";
  addBoth(11.0);
  EXPECT_EQ(without_image_, 10 - kRoom);
}

TEST_F(ExactSynchroniserTest, ALateMessageTakesNothingFromThoseThatWait) {
  for (int i = 1; i <= 2 * kRoom; ++i) addBoth(i);
  synchroniser_.add<0>(at<Image>(100.0));
  synchroniser_.add<0>(at<Image>(1.5));
  synchroniser_.add<1>(at<CameraInfo>(100.0));
  EXPECT_EQ(sets_.size(), 2u * kRoom + 1);
  EXPECT_EQ(sets_.back(), 100.0);
}

TEST_F(ExactSynchroniserTest, AStampThatCannotBeComparedIsRefused) {
  EXPECT_THROW(synchroniser_.add<0>(at<Image>(0.0)), std::invalid_argument);
  EXPECT_THROW(synchroniser_.add<1>(at<CameraInfo>(4e9)), std::invalid_argument);
  addBoth(1.0);
  EXPECT_EQ(sets_.size(), 1u);
}

}  // namespace test_exact_synchroniser
}  // namespace sdvo
