#include <gtest/gtest.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <boost/make_shared.hpp>
#include <random>
#include <vector>

#include "../../src/check/arrival_log.hpp"
#include "../../src/messages/stamps.hpp"
#include "../../src/ros/synchronisation/synchronisers.hpp"
#include "../said.hpp"

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

/// With the log of arrivals as in the nodelet: every pair is used, or counted once.
struct JitterTest : ::testing::Test {
  JitterTest() { log_.begin({"/l/image", "/r/image", "/l/info", "/r/info"}, 0.0); }

  std::uint64_t unpaired() const { return unused_.count(UnusedInput::kUnpaired); }

  const StereoInputOptions options_;
  UnusedInput unused_{"pairs", 0.05};
  ArrivalLog log_{options_, unused_};
  int used = 0;
  TriggerSynchroniser<sensor_msgs::Image, sensor_msgs::Image, sensor_msgs::CameraInfo, sensor_msgs::CameraInfo>
      synchroniser{options_.sync_queue_size, options_.pairing.sync_tolerance,
                   [this](const auto& left, const auto& right, const auto&, const auto&) {
                     ++used;
                     log_.notePair(nanoseconds(left->header.stamp), nanoseconds(right->header.stamp), now);
                   }};
  double now = 0.0;

  template <ArrivalLog::Input input, class Message>
  void send(double stamp) {
    const auto message = boost::make_shared<Message>();
    message->header.stamp = ros::Time(stamp);
    log_.note(input, nanoseconds(message->header.stamp), now);
    synchroniser.add<input>(boost::shared_ptr<const Message>(message));
  }

  void send(int pair, double apart, bool has_left = true, bool has_right = true) {
    now = 0.05 * pair;
    const double left = 100.0 + 0.05 * pair, right = left + apart;
    if (has_left) send<ArrivalLog::kLeftImage, sensor_msgs::Image>(left);
    send<ArrivalLog::kLeftInfo, sensor_msgs::CameraInfo>(left);
    if (has_right) send<ArrivalLog::kRightImage, sensor_msgs::Image>(right);
    send<ArrivalLog::kRightInfo, sensor_msgs::CameraInfo>(right);
  }
};

TEST_F(JitterTest, OfFiveHundredPairsWhoseStampsDifferEachIsUsedOrCountedAndTheSpreadIsSaid) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> apart(-0.004, 0.004);
  std::string said;
  for (int pair = 0; pair < 500; ++pair) {
    send(pair, apart(random));
    const std::string loss = log_.explainLoss(now);
    if (said.empty() && !loss.empty()) {
      said = loss;
      EXPECT_LT(now, 3.0);
    }
  }
  const std::string loss = log_.explainLoss(now);
  expectWords(loss, {"stereo pairs in 5 s are not used", "left and", "the nearest stamps of left and right are 1.",
                     "ms apart, more than sync_tolerance (1.0 ms): set sync_tolerance to 0.0"});
  log_.explainLoss(now + 10.0);  // what waits for partners is given up
  EXPECT_GT(used, 80);
  EXPECT_LT(used, 200);
  EXPECT_EQ(used + unpaired(), 500u);
}

TEST_F(JitterTest, LostImagesOfEitherSideAreNamed) {
  for (int pair = 0; pair < 120; ++pair) send(pair, 0.0, true, pair % 3 != 1);
  EXPECT_TRUE(contains(log_.explainLoss(now), "left images have no right one within half a period"))
      << log_.explainLoss(now);
  for (int pair = 120; pair < 240; ++pair) send(pair, 0.0, pair % 2 == 0, true);
  EXPECT_TRUE(contains(log_.explainLoss(now), "right images have no left one within half a period"))
      << log_.explainLoss(now);
  log_.explainLoss(now + 10.0);
  EXPECT_EQ(used + unpaired(), 240u);
}

}  // namespace sdvo::test_synchronisers
