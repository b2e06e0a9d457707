#include <gtest/gtest.h>

#include "../../src/ros/synchronisation/camera_finder.hpp"
#include "../said.hpp"

namespace sdvo::test_camera_finder {

ros::master::V_TopicInfo topics(const std::vector<std::string>& folders, const std::vector<std::string>& images) {
  ros::master::V_TopicInfo topics;
  for (const std::string& folder : folders) {
    topics.emplace_back(folder + "camera_info", "sensor_msgs/CameraInfo");
    for (const std::string& image : images) {
      topics.emplace_back(folder + image, "sensor_msgs/Image");
      topics.emplace_back(folder + image + "/compressed", "sensor_msgs/CompressedImage");
    }
  }
  return topics;
}

/// What the drivers of docs/cameras.md publish.
TEST(CameraFinder, KnowsTheDriversNames) {
  const auto realsense = findStereoCameras(
      "/camera/", topics({"/camera/infra1/", "/camera/infra2/", "/camera/depth/"}, {"image_rect_raw", "image_raw"}));
  ASSERT_EQ(realsense.size(), 1u);
  EXPECT_EQ(realsense[0].at("left/image_rect"), "/camera/infra1/image_rect_raw");
  EXPECT_EQ(realsense[0].at("right/image_rect"), "/camera/infra2/image_rect_raw");
  EXPECT_EQ(realsense[0].at("left/camera_info"), "/camera/infra1/camera_info");
  EXPECT_EQ(realsense[0].at("right/camera_info"), "/camera/infra2/camera_info");
  const auto zed =
      findStereoCameras("/zed2/", topics({"/zed2/zed_node/left/", "/zed2/zed_node/right/", "/zed2/zed_node/rgb/"},
                                         {"image_rect_color", "image_rect_gray"}));
  ASSERT_EQ(zed.size(), 1u);
  EXPECT_EQ(zed[0].at("right/image_rect"), "/zed2/zed_node/right/image_rect_gray");
}

TEST(CameraFinder, TheNamespacesOwnNameIsNoSide) {
  const auto found = findStereoCameras("/left/", topics({"/left/cam0/", "/left/cam1/"}, {"image_rect"}));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].at("right/image_rect"), "/left/cam1/image_rect");
}

TEST(CameraFinder, WhatIsNoRectifiedPairIsNone) {
  EXPECT_TRUE(findStereoCameras("/stereo/", topics({"/stereo/left/", "/stereo/right/"}, {"image_raw"})).empty());
  EXPECT_TRUE(findStereoCameras("/stereo/", topics({"/stereo/left/"}, {"image_rect"})).empty());
  EXPECT_TRUE(findStereoCameras("/stereo/", topics({"/other/left/", "/other/right/"}, {"image_rect"})).empty());
  auto uncalibrated = topics({"/stereo/left/", "/stereo/right/"}, {"image_rect"});
  uncalibrated.erase(uncalibrated.begin());
  EXPECT_TRUE(findStereoCameras("/stereo/", uncalibrated).empty());
}

TEST(CameraFinder, TopicsWithoutAPublisherAreNamed) {
  auto published = topics({"/stereo/left/", "/stereo/right/"}, {"image_rect"});
  const std::vector<std::string> names = {"/stereo/left/image_rect", "/stereo/right/image_rect",
                                          "/stereo/left/camera_info"};
  EXPECT_EQ(explainUnpublished(names, published), "");
  const std::string other = "; nobody publishes /other/image_rect";
  EXPECT_EQ(explainUnpublished({"/other/image_rect"}, {}), other);
  EXPECT_EQ(explainUnpublished({"/other/image_rect"}, published),
            other + "; stereo cameras are on: /stereo/left/image_rect");
  EXPECT_EQ(explainUnpublished({"/other/image_rect"}, topics({"/stereo/left/", "/stereo/right/"}, {"image_raw"})),
            other + "; raw stereo cameras, for stereo_raw.launch, are on: /stereo/left/image_raw");
  published.erase(published.begin() + 1);
  const std::string only_compressed = explainUnpublished(names, published);
  EXPECT_EQ(only_compressed.find("; nobody publishes /stereo/left/image_rect, but its /compressed: set "), 0u);
  EXPECT_TRUE(contains(only_compressed, "left_image/image_transport")) << only_compressed;
  EXPECT_FALSE(contains(only_compressed, "/stereo/right")) << only_compressed;
}

TEST(CameraFinder, EachOfSeveralIsFound) {
  const auto found = findStereoCameras(
      "/robot/",
      topics({"/robot/front/left/", "/robot/front/right/", "/robot/back/left/", "/robot/back/right/"}, {"image_rect"}));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].at("left/image_rect"), "/robot/back/left/image_rect");
  EXPECT_EQ(found[1].at("left/image_rect"), "/robot/front/left/image_rect");
}

class CameraFinderTest : public ::testing::Test {
 protected:
  ros::master::V_TopicInfo with(std::vector<std::string> folders) { return topics(folders, {"image_rect"}); }

  CameraFinder finder_{"/stereo", "/stereo/left/image_rect", "/stereo/right/image_rect"};
  std::string report_;
};

TEST_F(CameraFinderTest, TheOnlyCameraIsTakenWithAReasonAndGivenBackOnceTheNodesOwnImagesAppear) {
  const auto other = with({"/stereo/front/left/", "/stereo/front/right/"});
  ASSERT_TRUE(finder_.update(other, report_));
  EXPECT_EQ(finder_.names().at("left/image_rect"), "/stereo/front/left/image_rect");
  for (const char* word : {"nobody publishes /stereo/left/image_rect", "/stereo/front/right/image_rect", "find_camera"})
    EXPECT_TRUE(contains(report_, word)) << report_;
  EXPECT_TRUE(finder_.isSearching(true)) << "for the node's own images";
  EXPECT_FALSE(finder_.update(other, report_)) << "it is in use";
  const auto two = with({"/stereo/front/left/", "/stereo/front/right/", "/stereo/back/left/", "/stereo/back/right/"});
  EXPECT_FALSE(finder_.update(two, report_)) << "a camera in use stays";
  EXPECT_FALSE(finder_.update({}, report_)) << "a driver that restarts";
  ASSERT_TRUE(finder_.update(with({"/stereo/left/", "/stereo/front/left/", "/stereo/front/right/"}), report_));
  EXPECT_TRUE(finder_.names().empty());
  EXPECT_EQ(report_.find("somebody publishes /stereo/left/image_rect"), 0u) << report_;
  ASSERT_TRUE(finder_.isSearching(true)) << "the two drivers may take turns";
  EXPECT_TRUE(finder_.update(other, report_));
}

TEST_F(CameraFinderTest, OfSeveralNoneIsTaken) {
  EXPECT_FALSE(finder_.update(
      with({"/stereo/front/left/", "/stereo/front/right/", "/stereo/back/left/", "/stereo/back/right/"}), report_));
  EXPECT_TRUE(finder_.names().empty());
  EXPECT_TRUE(contains(report_, "several stereo cameras in /stereo/: ")) << report_;
}

TEST_F(CameraFinderTest, NamesThatTheUserChoseStay) {
  CameraFinder finder("/stereo", "/stereo/cam/left", "/stereo/right/image_rect");
  EXPECT_FALSE(finder.update(with({"/stereo/front/left/", "/stereo/front/right/"}), report_));
  EXPECT_EQ(report_, "");
  EXPECT_TRUE(finder.isSearching(false));
  EXPECT_FALSE(finder.isSearching(true));
}

}  // namespace sdvo::test_camera_finder
