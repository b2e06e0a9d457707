#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <boost/make_shared.hpp>
#include <vector>

#include "../../src/messages/stamps.hpp"
#include "../../src/ros/synchronisation/synchronisers.hpp"

namespace sdvo::test_synchronisers {

using sensor_msgs::CameraInfo;
using sensor_msgs::Image;

class TriggerSynchroniserTest : public ::testing::Test {
 protected:
  static constexpr int kRoom = 4;
  static constexpr double kTolerance = 0.001;  // s

  TriggerSynchroniserTest() { ros::Time::init(); }

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
  TriggerSynchroniser<Image, CameraInfo> synchroniser_{
      kRoom, kTolerance,
      [this](const Image::ConstPtr& image, const CameraInfo::ConstPtr& info) {
        EXPECT_LE(std::abs(secondsBetween(image->header.stamp, info->header.stamp)), kTolerance);
        sets_.push_back(image->header.stamp.toSec());
      },
      [this](const Image::ConstPtr& image, const CameraInfo::ConstPtr& info) {
        without_info_ += image && !info;
        without_image_ += info && !image;
      }};
};

TEST_F(TriggerSynchroniserTest, WhatHasOneStampIsASet) {
  addBoth(1.0);
  synchroniser_.add<0>(at<Image>(2.0));
  EXPECT_EQ(sets_, (std::vector<double>{1.0}));
  addBoth(3.0);
  EXPECT_EQ(sets_, (std::vector<double>{1.0, 3.0}));
  EXPECT_EQ(without_info_, 1) << "the image at 2 s";
  EXPECT_EQ(without_image_, 0);
}

TEST_F(TriggerSynchroniserTest, StampsOfOneTriggerThatDifferALittleAreASet) {
  for (const double gap : {5e-5, -5e-5, 9e-4, -9e-4}) {
    sets_.clear();
    for (int i = 1; i <= 20; ++i) {
      synchroniser_.add<0>(at<Image>(0.003 * i));  // the fastest cameras
      synchroniser_.add<1>(at<CameraInfo>(0.003 * i + gap));
    }
    EXPECT_EQ(sets_.size(), 20u) << gap;
  }
  synchroniser_.add<0>(at<Image>(5.0));
  synchroniser_.add<1>(at<CameraInfo>(5.0011));
  EXPECT_NE(sets_.back(), 5.0) << "beyond the tolerance";
}

TEST_F(TriggerSynchroniserTest, OfSeveralWithinTheToleranceTheNearestIsThePartner) {
  synchroniser_.add<0>(at<Image>(1.0));
  synchroniser_.add<0>(at<Image>(1.0008));
  synchroniser_.add<1>(at<CameraInfo>(1.0007));
  EXPECT_EQ(sets_, (std::vector<double>{1.0008}));
}

TEST_F(TriggerSynchroniserTest, WhatOneInputLeftOverDoesNotOutliveAJumpBack) {
  for (int i = 0; i < 2 * kRoom; ++i) synchroniser_.add<0>(at<Image>(100.0 + i));
  for (int i = 0; i < 3; ++i) addBoth(10.0 + i);
  EXPECT_EQ(sets_, (std::vector<double>{10.0, 11.0, 12.0}));
}

TEST_F(TriggerSynchroniserTest, TheFutureShutsNothingOut) {
  for (int i = 0; i < 2 * kRoom; ++i) synchroniser_.add<0>(at<Image>(5000.0 + i));
  for (int i = 0; i < 50; ++i) addBoth(100.0 + i);
  EXPECT_EQ(sets_.size(), 50u);
  EXPECT_EQ(without_info_, 2 * kRoom);
}

TEST_F(TriggerSynchroniserTest, ASetOfTheFutureTakesNothingFromThoseThatCameAfterIt) {
  synchroniser_.add<0>(at<Image>(5000.0));
  synchroniser_.add<0>(at<Image>(1.0));
  synchroniser_.add<1>(at<CameraInfo>(5000.0));
  synchroniser_.add<1>(at<CameraInfo>(1.0));
  EXPECT_EQ(sets_, (std::vector<double>{5000.0, 1.0}));
  EXPECT_EQ(without_info_ + without_image_, 0);
}

TEST_F(TriggerSynchroniserTest, WhatComesTooLateTakesNothingFromTheRest) {
  for (int i = 0; i < 10; ++i) synchroniser_.add<0>(at<Image>(1.0 + i));
  EXPECT_EQ(without_info_, 10 - kRoom);
  for (int i = 0; i < 10; ++i) synchroniser_.add<1>(at<CameraInfo>(1.0 + i));
  EXPECT_EQ(sets_, (std::vector<double>{7.0, 8.0, 9.0, 10.0})) << "the images that wait";
  addBoth(11.0);
  EXPECT_EQ(without_image_, 10 - kRoom);
}

TEST_F(TriggerSynchroniserTest, ALateMessageTakesNothingFromThoseThatWait) {
  for (int i = 1; i <= 2 * kRoom; ++i) addBoth(i);
  synchroniser_.add<0>(at<Image>(100.0));
  synchroniser_.add<0>(at<Image>(1.5));
  synchroniser_.add<1>(at<CameraInfo>(100.0));
  EXPECT_EQ(sets_.size(), 2u * kRoom + 1);
  EXPECT_EQ(sets_.back(), 100.0);
}

TEST_F(TriggerSynchroniserTest, AStampThatCannotBeComparedIsRefused) {
  EXPECT_THROW(synchroniser_.add<0>(at<Image>(0.0)), std::invalid_argument);
  EXPECT_THROW(synchroniser_.add<1>(at<CameraInfo>(4e9)), std::invalid_argument);
  addBoth(1.0);
  EXPECT_EQ(sets_.size(), 1u);
}

TEST(ApproximateSynchroniser, BeginsAnewWhenStampsFall) {
  std::vector<double> sets;
  ApproximateSynchroniser<Image, CameraInfo> synchroniser(
      20, 0.01,
      [&](const Image::ConstPtr& image, const CameraInfo::ConstPtr&) { sets.push_back(image->header.stamp.toSec()); });
  const auto play = [&](double begin) {
    for (int i = 0; i < 20; ++i) {
      const auto image = boost::make_shared<Image>();
      image->header.stamp = ros::Time(begin + 0.05 * i);
      synchroniser.add<0>(Image::ConstPtr(image));
      const auto info = boost::make_shared<CameraInfo>();
      info->header.stamp = ros::Time(begin + 0.05 * i + 0.004);
      if (i % 5 != 4) synchroniser.add<1>(CameraInfo::ConstPtr(info));  // some are lost, so that partners wait
    }
    const auto size = sets.size();
    sets.clear();
    return size;
  };
  const std::size_t first = play(1000.0);
  EXPECT_GE(first, 15u);
  EXPECT_EQ(play(100.0), first);
  EXPECT_EQ(play(5000.0), first);
}

}  // namespace sdvo::test_synchronisers
