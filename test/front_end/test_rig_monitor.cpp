#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "../../src/front_end/block_search.hpp"
#include "../../src/front_end/rig_monitor.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_rig_monitor {

const cv::Size kSize(640, 400);
constexpr double kDisparity = 17.0;  // px

const synthetic::Texture& texture() {
  static const synthetic::Texture grown(11, 5.0, 160.0);
  return grown;
}

cv::Mat leftImage() {
  return synthetic::render(kSize, texture());
}

/// The right view of a plane at kDisparity whose content appears `dv` px lower and turned clockwise by `turn` rad.
cv::Mat rightImage(double dv, double turn = 0.0, double gain = 1.0) {
  const double middle_u = 0.5 * kSize.width, middle_v = 0.5 * kSize.height;
  return synthetic::render(kSize, [=](double u, double v) {
    const double x = u - middle_u, y = v - dv - middle_v;
    const double c = std::cos(turn), s = std::sin(turn);
    return gain * texture().at(middle_u + c * x + s * y + kDisparity, middle_v - s * x + c * y);
  });
}

std::vector<cv::Point2f> corners() {
  std::vector<cv::Point2f> positions;
  for (float v = 40.3f; v < 360.f; v += 29.1f)
    for (float u = 40.7f; u < 600.f; u += 31.3f) positions.emplace_back(u, v);
  return positions;
}

std::string diagnosis(const cv::Mat& left, const cv::Mat& right) {
  return RigMonitor({}, 1.5, 192.0).diagnose(left, right, corners()).words;
}

cv::Mat flipped(const cv::Mat& image, int code) {
  cv::Mat result;
  cv::flip(image, result, code);
  return result;
}

TEST(RigMonitor, LooksOnlyWhenFewCornersAreFound) {
  const RigMonitor monitor({}, 1.5, 192.0);
  EXPECT_FALSE(monitor.isSuspicious(1000, 400));
  EXPECT_TRUE(monitor.isSuspicious(1000, 399));
  EXPECT_FALSE(monitor.isSuspicious(24, 0)) << "too few to judge by";
  RigMonitorOptions off;
  off.suspicious_share = 0.0;
  EXPECT_FALSE(RigMonitor(off, 1.5, 192.0).isSuspicious(1000, 0));
}

TEST(RigMonitor, SaysNothingOfARigInOrderOrWhereNothingIsFound) {
  const cv::Mat left = leftImage(), dark(kSize, CV_8U, cv::Scalar(3));
  EXPECT_EQ(diagnosis(left, rightImage(0.0)), "");
  EXPECT_EQ(diagnosis(left, rightImage(1.0)), "") << "less than the matcher takes";
  EXPECT_EQ(diagnosis(left, rightImage(0.0, 0.0, 0.5)), "") << "gain is no fault of the rig";
  EXPECT_EQ(diagnosis(left, dark), "");
  EXPECT_EQ(diagnosis(dark, dark), "");
  EXPECT_EQ(diagnosis(left, synthetic::render(kSize, synthetic::Texture(99, 5.0, 160.0))), "");
  EXPECT_EQ(RigMonitor({}, 1.5, 192.0).diagnose(left, rightImage(4.0), {}).words, "");
}

TEST(RigMonitor, NamesWhatIsWrong) {
  constexpr double kDegree = CV_PI / 180.0;
  const cv::Mat left = leftImage(), right = rightImage(0.0);
  const std::string swapped = "are swapped, both are mirrored, or";
  const std::string left_mirrored = "left image is mirrored, or the right one is and both are swapped";
  const std::string right_mirrored = "right image is mirrored, or the left one is and both are swapped";
  // Waves of 6 px, as no offset and no rotation makes them.
  const cv::Mat wavy = synthetic::render(
      kSize, [](double u, double v) { return texture().at(u + kDisparity, v - 6.0 * std::sin(u / 40.0)); });
  struct Fault {
    cv::Mat left, right;
    std::string words;
  };
  for (const Fault& fault : {
           Fault{left, rightImage(4.0), "right image 4.0 px too low: not rectified?"},
           Fault{left, rightImage(-5.0), "right image 5.0 px too high: not rectified?"},
           Fault{left, rightImage(4.0, 0.0, 0.5), "right image 4.0 px too low"},
           Fault{left, rightImage(0.0, 2.0 * kDegree), "turned by 2.0 degrees clockwise"},
           Fault{left, rightImage(0.0, -3.0 * kDegree), "turned by 3.0 degrees counterclockwise"},
           Fault{left, wavy, "px here and there"},
           Fault{right, left, swapped},
           Fault{flipped(left, 1), flipped(right, 1), swapped},
           Fault{flipped(left, 1), right, left_mirrored},
           Fault{left, flipped(right, 1), right_mirrored},
           Fault{flipped(right, 1), left, right_mirrored},
           Fault{flipped(left, -1), right, "the left image is upside down"},
           Fault{left, flipped(right, -1), "the right image is upside down"},
           // A twentieth of the light, rounded to whole levels.
           Fault{0.05 * right, 0.05 * left, "are swapped, both are mirrored"},
           Fault{0.05 * left, 0.05 * rightImage(4.0), "px too low"},
       })
    expectWords(diagnosis(fault.left, fault.right), {fault.words});
}

// It takes milliseconds, and a view with little to match is suspicious pair after pair.
TEST(RigMonitor, LooksNoFurtherOnceAFewCornersClearIt) {
  // Rows agree in the left half only; of the corners in the right half nobody asks.
  cv::Mat right = rightImage(0.0);
  rightImage(6.0).colRange(kSize.width / 2, kSize.width).copyTo(right.colRange(kSize.width / 2, kSize.width));
  std::vector<cv::Point2f> left_half, right_half;
  for (const cv::Point2f& corner : corners())
    (corner.x < 0.5f * static_cast<float>(kSize.width) ? left_half : right_half).push_back(corner);
  const RigMonitor monitor({}, 1.5, 192.0);
  const auto diagnose = [&](const auto& is_left) {
    std::vector<cv::Point2f> mixed;
    for (std::size_t i = 0; i < 120; ++i) {
      const auto& half = is_left(i) ? left_half : right_half;
      mixed.push_back(half[i % half.size()]);
    }
    return monitor.diagnose(leftImage(), right, mixed).words;
  };
  EXPECT_EQ(diagnose([](std::size_t i) { return i < 20; }), "");
  EXPECT_NE(diagnose([](std::size_t i) { return i < 4; }), "") << "four are too few";
  EXPECT_NE(diagnose([](std::size_t i) { return i % 6 == 0; }), "") << "there is a doubt from the beginning";
}

/// A robot before a wall: few corners are in both views, and a wrong one far from them shows no slope of the rows.
TEST(RigMonitor, NamesAWallThatIsTooNear) {
  const RigMonitor monitor({}, 1.5, 192.0);
  for (const double share : {0.35, 0.45, 0.55, 0.65}) {
    const cv::Mat right =
        synthetic::render(kSize, [=](double u, double v) { return texture().at(u + share * kSize.width, v); });
    const RigDiagnosis diagnosis = monitor.diagnose(leftImage(), right, corners());
    EXPECT_TRUE(diagnosis.too_near) << share << diagnosis.words;
    EXPECT_FALSE(diagnosis.refused) << share << diagnosis.words;
    EXPECT_EQ(contains(diagnosis.words, "too near"), share > 0.5) << share << diagnosis.words;
  }
}

/// At the left border the first of the places that look alike is found from both sides.
TEST(BlockSearch, TextureThatRepeatsIsNoWitness) {
  cv::Mat unique = synthetic::noise({320, 200}, 7), repeating;
  cv::GaussianBlur(unique, unique, {}, 3.0);
  cv::normalize(unique, unique, 0, 255, cv::NORM_MINMAX);
  cv::repeat(unique.colRange(0, 80), 1, 4, repeating);
  for (float u = 30.f; u < 60.f; u += 10.f) {
    EXPECT_TRUE(BlockSearch(unique, unique, 100.0, 8.0).find({u, 100.f})) << u;
    EXPECT_FALSE(BlockSearch(repeating, repeating, 100.0, 8.0).find({u, 100.f})) << u;
  }
}

}  // namespace sdvo::test_rig_monitor
