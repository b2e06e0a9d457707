#include <gtest/gtest.h>

#include "../../src/common/text.hpp"

namespace sdvo {
namespace test_text {

TEST(Text, NamesThatDifferByFewLettersAreAlike) {
  for (const char* name : {"stereo_features", "stereo_feature", "StereoFeatures", "stereo-features", "stero_feature"})
    EXPECT_TRUE(isAlike(name, "stereo_features")) << name;
  for (const char* name : {"stereo", "features", "visual_odometry", "left_rectify", ""})
    EXPECT_FALSE(isAlike(name, "stereo_features")) << name;
  EXPECT_TRUE(isAlike("vo", "vo"));
  EXPECT_FALSE(isAlike("tf", "vo")) << "two letters of two";
}

}  // namespace test_text
}  // namespace sdvo
