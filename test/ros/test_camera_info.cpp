#include <gtest/gtest.h>

#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "message_samples.hpp"

namespace sdvo::ros_conversions::test_camera_info {

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

/// A left and a right camera_info, both changed alike.
struct Infos {
  explicit Infos(const std::function<void(sensor_msgs::CameraInfo&)>& change = [](auto&) {}) {
    change(left), change(right);
  }
  StereoCamera camera() const { return toStereoCamera(left, right); }

  sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
};

TEST(ToStereoCamera, BaselineIsTheDifferenceOfBothOffsets) {
  const StereoCamera camera = toStereoCamera(cameraInfo(42.0), cameraInfo(-336.0));
  EXPECT_EQ(camera, (StereoCamera{700.0, 700.0, 600.0, 180.0, camera.baseline, 1200, 360}));
  EXPECT_NEAR(camera.baseline, 0.54, 1e-12);  // (42 + 336) / 700
}

TEST(ToStereoCamera, GeometryComesFromPNotFromK) {
  const StereoCamera camera =
      Infos([](auto& info) { info.K = {900.0, 0.0, 1.0, 0.0, 900.0, 2.0, 0.0, 0.0, 1.0}; }).camera();
  EXPECT_DOUBLE_EQ(camera.fx, 700.0);
  EXPECT_DOUBLE_EQ(camera.cx, 600.0);
}

/// As of a driver that rectifies itself.
TEST(ToStereoCamera, PAloneIsEnough) {
  const Infos infos([](auto& info) {
    info.K.assign(0.0);
    info.R.assign(0.0);
    info.D.clear();
    info.distortion_model.clear();
  });
  EXPECT_EQ(infos.camera(), Infos().camera());
  EXPECT_EQ(whyUnrectified(infos.left, infos.right), "");
}

TEST(ToStereoCamera, BinningAndRegionOfInterest) {
  const Infos infos([](auto& info) {
    info.binning_x = info.binning_y = 2;
    info.roi.x_offset = 200;
    info.roi.y_offset = 40;
    info.roi.width = 800;
    info.roi.height = 240;
  });
  // (600 - 200) / 2, (180 - 40) / 2; metres do not shrink with the pixels.
  EXPECT_EQ(infos.camera(), (StereoCamera{350.0, 350.0, 200.0, 70.0, 0.5, 400, 120}));
}

TEST(ToStereoCamera, RefusesWhatIsNoRectifiedPair) {
  expectRefusals(Infos(), [](const Infos& infos) { infos.camera(); },
                 {{[](Infos& i) { i.right.P.assign(0.0); }, "right camera_info: P is zero"},
                  {[](Infos& i) { i.left.P.assign(0.0); }, "left camera_info: P is zero"},
                  {[](Infos& i) { i.left.width = 0; }, "size"},
                  {[](Infos& i) { i.left.P[3] = -700.0; }, "Swap the topics"},
                  {[](Infos& i) { i.left = cameraInfo(0.0, -700.0), i.right = cameraInfo(-350.0, -700.0); },
                   "left camera_info: a focal length in P is negative"},
                  {[](Infos& i) { i.right.P[3] = 350.0; }, "wrong sign"},
                  {[](Infos& i) { i.right = cameraInfo(-350.0, 701.0); }, "single calibrations"},
                  {[](Infos& i) { i.right.P[5] = 650.0; }, "single calibrations"},
                  // Rectified without CALIB_ZERO_DISPARITY: depth would be wrong everywhere.
                  {[](Infos& i) { i.right.P[2] += 5.0; }, "principal point"},
                  {[](Infos& i) { i.right.P[6] += 5.0; }, "principal point"},
                  {[](Infos& i) { i.right.P[3] = kNaN; }, "right camera_info: P[3] is not a number"},
                  {[](Infos& i) { i.right.width = 640; }, "left 1200x360, right 640x360"},
                  {[](Infos& i) { i.right.roi.x_offset = 1200; }, "right camera_info has no image size"},
                  {[](Infos& i) { i.right.roi.x_offset = 8, i.right.roi.width = i.left.width; }, "the same region"}});
  // Both projection matrices are quoted, so that the user sees which is wrong.
  expectError([] { toStereoCamera(cameraInfo(-350.0), cameraInfo(0.0)); },
              {"baseline", "Tx = -350", "Tx = 0", "swapped", "stereo_i_reverse_stereo_socket_order"});
  const std::string without_tx = errorOf([] { toStereoCamera(cameraInfo(0.0), cameraInfo(0.0)); });
  EXPECT_TRUE(contains(without_tx, "no baseline in P") && !contains(without_tx, "swapped")) << without_tx;
}

/// Simulators leave P[3] at 0 and have both optical frames on TF.
TEST(ToStereoCamera, ABaselineThatPLacksIsThatOfTheOpticalFramesOnTf) {
  sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(0.0);
  left.header.frame_id = "left_optical";
  right.header.frame_id = "/right_optical";
  Eigen::Isometry3d T_left_right = Eigen::Isometry3d(Eigen::Translation3d(0.12, 1e-4, 0.0));
  const auto find = [&](const std::string& parent, const std::string& child, std::string& problem) {
    problem = "unknown frame";
    return parent == "left_optical" && child == "right_optical" ? std::optional(T_left_right) : std::nullopt;
  };
  EXPECT_DOUBLE_EQ(toStereoCamera(left, right, find).baseline, 0.12);
  EXPECT_DOUBLE_EQ(toStereoCamera(left, cameraInfo(-350.0), find).baseline, 0.5) << "P has one";
  T_left_right.translation() = Eigen::Vector3d(0.0, -0.12, 0.0);  // of a body's frame, x ahead
  expectError([&] { toStereoCamera(left, right, find); }, {"no baseline in P", "'right_optical' at 0.000 -0.120", "optical"});
  right.header.frame_id = "elsewhere";
  expectError([&] { toStereoCamera(left, right, find); }, {"no baseline in P", "'elsewhere'", "unknown frame"});
  right.header.frame_id = left.header.frame_id;
  expectError([&] { toStereoCamera(left, right, find); }, {"no baseline in P", "both camera_info name the frame"});
}

TEST(ToStereoCamera, TheLensChangesNothingOfARegionOfInterest) {
  // A window out of the raw image (do_rectify, as CameraInfo.msg asks) is the same window of the rectified one:
  // image_proc publishes as many pixels. So are those that crop_decimate cuts out of rectified images.
  for (const bool do_rectify : {false, true})
    for (const std::vector<double>& lens : {std::vector<double>{}, {-0.28, 0.07, 2e-4, 2e-5, 0.0}, {0.1, 0.1, 0.1}}) {
      const Infos infos([&](auto& info) {
        info.D = lens;
        info.roi.x_offset = 41;
        info.roi.y_offset = 30;
        info.roi.width = 641;
        info.roi.height = 303;
        info.roi.do_rectify = do_rectify;
        info.binning_x = 2;
        info.binning_y = 4;
      });
      EXPECT_EQ(infos.camera(), (StereoCamera{350.0, 175.0, (600.0 - 41.0) / 2.0, (180.0 - 30.0) / 4.0, 0.5, 320, 75}));
    }
}

TEST(ToStereoCamera, ARegionWithoutASizeIsWhatIsLeft) {
  EXPECT_EQ(Infos([](auto& info) { info.roi.x_offset = 200; }).camera(),
            (StereoCamera{700.0, 700.0, 400.0, 180.0, 0.5, 1000, 360}));
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
  EXPECT_TRUE(contains(error, "baseline = -1.4")) << error;
  EXPECT_LT(error.size(), 500u) << error;
}

TEST(ToStereoCamera, AVerticalPairIsToldHowToTurn) {
  for (const double ty : {-35.0, 35.0}) {  // below, above: 5 cm
    sensor_msgs::CameraInfo second = cameraInfo(0.0);
    second.P[7] = ty;
    const std::string why = errorOf([&] { toStereoCamera(cameraInfo(0.0), second); });
    expectWords(why, {"baseline of 0.050000 m is vertical (P[7])", "counter-clockwise by 90 degrees",
                      ty < 0.0 ? "now the left one" : "now the right one"});
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

}  // namespace sdvo::ros_conversions::test_camera_info
