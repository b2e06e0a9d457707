#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../synthetic_scene.hpp"
#include "message_samples.hpp"

namespace sdvo::ros_conversions {
namespace test_camera_info {

using synthetic::errorOf;

sensor_msgs::CameraInfo cameraInfo(double tx, double f = 700.0) {
  sensor_msgs::CameraInfo info;
  info.width = 1200;
  info.height = 360;
  info.distortion_model = "plumb_bob";
  info.D.assign(5, 0.0);
  info.K = {f, 0.0, 600.0, 0.0, f, 180.0, 0.0, 0.0, 1.0};
  info.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.P = {f, 0.0, 600.0, tx, 0.0, f, 180.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

TEST(ToStereoCamera, BaselineIsTheDifferenceOfBothOffsets) {
  const StereoCamera camera = toStereoCamera(cameraInfo(42.0), cameraInfo(-336.0));
  EXPECT_DOUBLE_EQ(camera.fx, 700.0);
  EXPECT_DOUBLE_EQ(camera.fy, 700.0);
  EXPECT_DOUBLE_EQ(camera.cx, 600.0);
  EXPECT_DOUBLE_EQ(camera.cy, 180.0);
  EXPECT_NEAR(camera.baseline, 0.54, 1e-12);  // (42 + 336) / 700
  EXPECT_EQ(camera.width, 1200);
  EXPECT_EQ(camera.height, 360);
}

TEST(ToStereoCamera, GeometryComesFromPNotFromK) {
  sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
  for (sensor_msgs::CameraInfo* info : {&left, &right}) info->K = {900.0, 0.0, 1.0, 0.0, 900.0, 2.0, 0.0, 0.0, 1.0};
  const StereoCamera camera = toStereoCamera(left, right);
  EXPECT_DOUBLE_EQ(camera.fx, 700.0);
  EXPECT_DOUBLE_EQ(camera.cx, 600.0);
}

/// As of a driver that rectifies itself.
TEST(ToStereoCamera, PAloneIsEnough) {
  sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
  for (sensor_msgs::CameraInfo* info : {&left, &right}) {
    info->K.assign(0.0);
    info->R.assign(0.0);
    info->D.clear();
    info->distortion_model.clear();
  }
  EXPECT_EQ(toStereoCamera(left, right), toStereoCamera(cameraInfo(0.0), cameraInfo(-350.0)));
  EXPECT_EQ(whyUnrectified(left, right), "");
}

TEST(ToStereoCamera, BinningAndRegionOfInterest) {
  sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
  for (sensor_msgs::CameraInfo* info : {&left, &right}) {
    info->binning_x = info->binning_y = 2;
    info->roi.x_offset = 200;
    info->roi.y_offset = 40;
    info->roi.width = 800;
    info->roi.height = 240;
  }
  const StereoCamera camera = toStereoCamera(left, right);
  EXPECT_DOUBLE_EQ(camera.fx, 350.0);
  EXPECT_DOUBLE_EQ(camera.fy, 350.0);
  EXPECT_DOUBLE_EQ(camera.cx, 200.0);        // (600 - 200) / 2
  EXPECT_DOUBLE_EQ(camera.cy, 70.0);         // (180 - 40) / 2
  EXPECT_NEAR(camera.baseline, 0.5, 1e-12);  // metres do not shrink with the pixels
  EXPECT_EQ(camera.width, 400);
  EXPECT_EQ(camera.height, 120);
}

TEST(ToStereoCamera, RefusesWhatIsNoRectifiedPair) {
  const sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
  ASSERT_NO_THROW(toStereoCamera(left, right));
  const auto refusal = [](const sensor_msgs::CameraInfo& l, const sensor_msgs::CameraInfo& r) {
    EXPECT_THROW(toStereoCamera(l, r), std::invalid_argument);
    return errorOf([&] { toStereoCamera(l, r); });
  };

  sensor_msgs::CameraInfo uncalibrated = right;
  uncalibrated.P.assign(0.0);
  EXPECT_TRUE(contains(refusal(left, uncalibrated), "right camera_info: P is zero"));
  EXPECT_TRUE(contains(refusal(uncalibrated, right), "left camera_info: P is zero"));
  sensor_msgs::CameraInfo no_size = left;
  no_size.width = 0;
  EXPECT_TRUE(contains(refusal(no_size, right), "size"));

  // Swapped: both projection matrices are quoted, so that the user sees which is wrong.
  const std::string swapped = refusal(right, left);
  EXPECT_TRUE(contains(swapped, "baseline")) << swapped;
  EXPECT_TRUE(contains(swapped, "Tx = -350")) << swapped;
  EXPECT_TRUE(contains(swapped, "Tx = 0")) << swapped;
  EXPECT_TRUE(contains(swapped, "swapped")) << swapped;
  EXPECT_TRUE(contains(swapped, "stereo_i_reverse_stereo_socket_order")) << swapped;
  const std::string both_have_one = refusal(cameraInfo(-700.0), cameraInfo(-350.0));
  EXPECT_TRUE(contains(both_have_one, "Swap the topics")) << both_have_one;
  const std::string negative = refusal(cameraInfo(0.0, -700.0), cameraInfo(-350.0, -700.0));
  EXPECT_TRUE(contains(negative, "left camera_info: a focal length in P is negative")) << negative;
  const std::string without_tx = refusal(left, left);
  EXPECT_TRUE(contains(without_tx, "no baseline in P")) << without_tx;
  EXPECT_FALSE(contains(without_tx, "swapped")) << without_tx;
  const std::string wrong_sign = refusal(left, cameraInfo(350.0));
  EXPECT_TRUE(contains(wrong_sign, "wrong sign")) << wrong_sign;

  EXPECT_TRUE(contains(refusal(left, cameraInfo(-350.0, 701.0)), "not rectified"));
  // Rectified without CALIB_ZERO_DISPARITY: depth would be wrong everywhere.
  sensor_msgs::CameraInfo shifted = right;
  shifted.P[2] += 5.0;
  EXPECT_TRUE(contains(refusal(left, shifted), "principal point"));
  shifted = right;
  shifted.P[6] += 5.0;
  EXPECT_TRUE(contains(refusal(left, shifted), "principal point"));
  sensor_msgs::CameraInfo unequal = right;
  unequal.P[5] = 650.0;
  EXPECT_TRUE(contains(refusal(left, unequal), "not rectified"));
  sensor_msgs::CameraInfo not_finite = right;
  not_finite.P[3] = kNaN;
  EXPECT_TRUE(contains(refusal(left, not_finite), "right camera_info: P[3] is not a number"));
  sensor_msgs::CameraInfo smaller = right;
  smaller.width = 640;
  EXPECT_TRUE(contains(refusal(left, smaller), "left 1200x360, right 640x360"));
  for (sensor_msgs::CameraInfo* info : {&smaller, &shifted}) *info = right;
  smaller.roi.x_offset = 1200;
  EXPECT_TRUE(contains(refusal(left, smaller), "right camera_info has no image size"));
  shifted.roi.x_offset = 8;
  shifted.roi.width = left.width;
  EXPECT_TRUE(contains(refusal(left, shifted), "the same region"));
}

TEST(ToStereoCamera, TheLensChangesNothingOfARegionOfInterest) {
  // A window out of the raw image (do_rectify, as CameraInfo.msg asks) is the same window of the rectified one:
  // image_proc publishes as many pixels. So are those that crop_decimate cuts out of rectified images.
  for (const bool do_rectify : {false, true})
    for (const std::vector<double>& lens : {std::vector<double>{}, {-0.28, 0.07, 2e-4, 2e-5, 0.0}, {0.1, 0.1, 0.1}}) {
      sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
      for (sensor_msgs::CameraInfo* info : {&left, &right}) {
        info->D = lens;
        info->roi.x_offset = 41;
        info->roi.y_offset = 30;
        info->roi.width = 641;
        info->roi.height = 303;
        info->roi.do_rectify = do_rectify;
        info->binning_x = 2;
        info->binning_y = 4;
      }
      const StereoCamera camera = toStereoCamera(left, right);
      EXPECT_EQ(camera, (StereoCamera{350.0, 175.0, (600.0 - 41.0) / 2.0, (180.0 - 30.0) / 4.0, 0.5, 320, 75}));
    }
}

TEST(ToStereoCamera, ARegionWithoutASizeIsWhatIsLeft) {
  sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
  for (sensor_msgs::CameraInfo* info : {&left, &right}) info->roi.x_offset = 200;
  const StereoCamera camera = toStereoCamera(left, right);
  EXPECT_EQ(camera.width, 1000);
  EXPECT_EQ(camera.height, 360);
  EXPECT_EQ(camera.cx, 400.0);
}

TEST(ToStereoCamera, PMayBeRounded) {
  for (const std::size_t number : {0u, 2u, 5u, 6u}) {
    sensor_msgs::CameraInfo right = cameraInfo(-350.0);
    right.P[number] += 0.02;  // px
    EXPECT_NO_THROW(toStereoCamera(cameraInfo(0.0), right)) << number;
    right.P[number] += 0.1;
    EXPECT_THROW(toStereoCamera(cameraInfo(0.0), right), std::invalid_argument) << number;
  }
}

TEST(ToStereoCamera, WildNumbersHaveFewDigits) {
  const std::string error = errorOf([] { toStereoCamera(cameraInfo(0.0), cameraInfo(1e300)); });
  EXPECT_NE(error.find("baseline = -1.4"), std::string::npos) << error;
  EXPECT_LT(error.size(), 500u) << error;
}

TEST(ToStereoCamera, AVerticalPairIsToldHowToTurn) {
  const sensor_msgs::CameraInfo first = cameraInfo(0.0);
  sensor_msgs::CameraInfo second = first;
  for (const double ty : {-35.0, 35.0}) {  // below, above: 5 cm
    second.P[7] = ty;
    const std::string why = errorOf([&] { toStereoCamera(first, second); });
    EXPECT_TRUE(contains(why, "baseline of 0.050000 m is vertical (P[7])")) << why;
    EXPECT_TRUE(contains(why, "counter-clockwise by 90 degrees")) << why;
    EXPECT_TRUE(contains(why, ty < 0.0 ? "now the left one" : "now the right one")) << why;
    EXPECT_FALSE(contains(why, "P[3]")) << why;
  }
}

TEST(WhyUnrectified, ARotationWithoutDistortionIsNotTakenOutByImageProc) {
  sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
  EXPECT_EQ(whyUnrectified(left, right), "");
  const double angle = 0.01;  // 7 px
  right.R = {1.0, 0.0, 0.0, 0.0, std::cos(angle), -std::sin(angle), 0.0, std::sin(angle), std::cos(angle)};
  EXPECT_TRUE(contains(whyUnrectified(left, right), "D of camera_info is zero and R is not the identity"));
  right.D.clear();
  EXPECT_NE(whyUnrectified(left, right), "");
  right.D.assign(5, 1e-9);
  EXPECT_EQ(whyUnrectified(left, right), "");
  right.D.assign(5, 0.0);
  right.R.assign(0.0);
  EXPECT_EQ(whyUnrectified(left, right), "") << "R was left out";
}

}  // namespace test_camera_info
}  // namespace sdvo::ros_conversions
