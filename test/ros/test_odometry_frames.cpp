#include <gtest/gtest.h>

#include "../../src/ros/transforms/odometry_frames.hpp"
#include "../said.hpp"

namespace sdvo::test_odometry_frames {

OdometryOutputOptions with(const std::string& odom, const std::string& base, const std::string& guess = "") {
  OdometryOutputOptions options;
  options.odom_frame_id = odom;
  options.base_frame_id = base;
  options.guess_frame_id = guess;
  return options;
}

std::string refusal(const OdometryOutputOptions& options) {
  return errorOf([&] { withCleanFrames(options); });
}

TEST(OdometryFrames, LeadingSlashesGo) {
  const OdometryOutputOptions clean = withCleanFrames(with("/odom", "/robot", "/wheels"));
  EXPECT_EQ(clean.odom_frame_id, "odom");
  EXPECT_EQ(clean.base_frame_id, "robot");
  EXPECT_EQ(clean.guess_frame_id, "wheels");
  EXPECT_EQ(clean.ground_truth_base_frame_id, "robot");
}

TEST(OdometryFrames, ContradictionsAreRefused) {
  expectWords(refusal(with("", "base_link")), {"odom_frame_id is empty"});
  expectWords(refusal(with("/map", "map")), {"odom_frame_id and base_frame_id are both 'map'"});
  expectWords(refusal(with("odom", "base_link", "base_link")), {"guess_frame_id and base_frame_id"});
  expectWords(refusal(with("odom", "base_link", "odom")), {"guess_frame_id and odom_frame_id"});
  OdometryOutputOptions truth = with("odom", "base_link");
  truth.ground_truth_frame_id = "world";
  expectWords(refusal(truth), {"set ground_truth_base_frame_id"});
  truth.publish_tf = false;
  EXPECT_EQ(refusal(truth), "no error");
}

TEST(OdometryFrames, ThePublishedTransformIsTheGuesssOrInvertedOrNone) {
  OdometryOutputOptions options = with("odom", "base_link", "wheels");
  EXPECT_EQ(publishedFrames(options)->base, "wheels");
  options.guess_frame_id.clear();
  EXPECT_EQ(publishedFrames(options)->base, "base_link");
  options.invert_tf = true;
  EXPECT_EQ(publishedFrames(options)->odom, "base_link");
  options.publish_tf = false;
  EXPECT_FALSE(publishedFrames(options));
}

}  // namespace sdvo::test_odometry_frames
