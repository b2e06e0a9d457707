#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <tuple>

#include "../../src/data/stereo_rectification.hpp"
#include "../said.hpp"
#include "../temporary_folder.hpp"

namespace sdvo::test_stereo_rectification {

RawCamera rawCamera(const cv::Size& size, double f, const std::string& lens, const std::vector<double>& D) {
  RawCamera camera;
  camera.size = size;
  camera.K = {f, 0.0, 0.5 * size.width + 3.0, 0.0, f + 0.5, 0.5 * size.height - 4.0, 0.0, 0.0, 1.0};
  camera.setLens(lens, D);
  return camera;
}

/// Of EuRoC, TUM-VI and a T265.
const RawCamera kRadtan = rawCamera({752, 480}, 458.0, "radtan", {-0.283, 0.074, 0.0002, 0.00002});
const RawCamera kWide = rawCamera({512, 512}, 191.0, "equidistant", {0.0035, 0.0007, -0.002, 0.0002});
const RawCamera kT265 = rawCamera({848, 800}, 286.0, "kannala_brandt4", {-0.007, 0.044, -0.042, 0.008, 0.0});

Eigen::Isometry3d poseOfTheRight(double x = -0.1) {
  return Eigen::Translation3d(x, 0.001, 0.002) * Eigen::AngleAxisd(0.02, Eigen::Vector3d(0.4, -0.9, 0.2).normalized());
}

cv::Point2d projectRaw(const RawCamera& camera, const Eigen::Vector3d& point) {
  const std::vector<cv::Point3d> points = {{point.x(), point.y(), point.z()}};
  const cv::Vec3d none(0.0, 0.0, 0.0);
  std::vector<cv::Point2d> pixels;
  if (camera.is_equidistant)
    cv::fisheye::projectPoints(points, pixels, none, none, camera.K, camera.D);
  else
    cv::projectPoints(points, none, none, camera.K, camera.D, pixels);
  return pixels[0];
}

/// Raw images that hold their own coordinates.
TEST(StereoRectification, APointIsOnOneRowWithTheDisparityOfItsDepth) {
  for (const RawCamera& lens : {kRadtan, kWide, kT265})
    for (const double fov : {0.0, 80.0}) {
      const Eigen::Isometry3d T_right_left = poseOfTheRight();
      const StereoRectification rectification({lens, lens}, T_right_left, fov);
      cv::Mat coordinates(lens.size, CV_32FC2);
      for (int y = 0; y < coordinates.rows; ++y)
        for (int x = 0; x < coordinates.cols; ++x) coordinates.at<cv::Vec2f>(y, x) = cv::Vec2f(float(x), float(y));
      const ImagePair rectified = rectification.rectify({coordinates, coordinates});
      const StereoCamera& camera = rectification.camera();
      EXPECT_NEAR(camera.baseline, T_right_left.translation().norm(), 1e-9);
      Eigen::Matrix3d R_rect_left;
      cv::cv2eigen(rectification.rotation(0), R_rect_left);
      for (const int row : {40, 240, 400})
        for (const int left : {100, 300, 480}) {
          const int disparity = 20;
          const Eigen::Vector3d point = R_rect_left.transpose() * camera.backProject(left, row, disparity);
          const cv::Vec2f at_left = rectified.left.at<cv::Vec2f>(row, left),
                          at_right = rectified.right.at<cv::Vec2f>(row, left - disparity);
          const cv::Point2d true_left = projectRaw(lens, point), true_right = projectRaw(lens, T_right_left * point);
          EXPECT_NEAR(at_left[0], true_left.x, 0.05) << lens.size << " " << fov;  // px; remap's steps of 1/32
          EXPECT_NEAR(at_left[1], true_left.y, 0.05);
          EXPECT_NEAR(at_right[0], true_right.x, 0.05);
          EXPECT_NEAR(at_right[1], true_right.y, 0.05);
        }
    }
}

TEST(StereoRectification, AWideLensKeepsTheResolutionOfItsMiddle) {
  const auto fov = [](const RawCamera& lens, double wanted) {
    const StereoCamera camera = StereoRectification({lens, lens}, poseOfTheRight(), wanted).camera();
    return 360.0 / M_PI * std::atan(0.5 * camera.width / camera.fx);
  };
  for (const RawCamera& lens : {kWide, kT265}) {
    EXPECT_NEAR(fov(lens, 0.0), 110.0, 1e-9);
    EXPECT_NEAR(fov(lens, 140.0), 140.0, 1e-9);
  }
  EXPECT_LT(fov(kRadtan, 0.0), 85.0);  // what the lens has without black borders
}

TEST(StereoRectification, CamerasThatAreNoPairAreNamed) {
  RawCamera other = kRadtan;
  other.setLens("fisheye", {0.0, 0.0, 0.0, 0.0});
  for (const auto& [right, x, words] :
       {std::tuple(kRadtan, 0.1, "swapped"), {kWide, -0.1, "resolution"}, {other, -0.1, "lens model"}})
    expectError([&, camera = right, at = x] { StereoRectification({kRadtan, camera}, poseOfTheRight(at)); }, {words});
}

/// One rig in the three formats, with lenses of no distortion and axes that agree.
struct Files {
  std::string lens = "equidistant", T_cn_cnm1 = "[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]";
  std::string model = "pinhole", right_p = "50, 0, 60, -5, 0, 50, 40, 0, 0, 0, 1, 0";
};

class CalibrationFile : public testing::Test {
 protected:
  std::string write(const std::string& words) const {
    const std::string path = (folder_.path() / (std::to_string(written_++) + ".yaml")).string();
    std::ofstream(path) << words;
    return path;
  }

  std::string camera(const Files& files, const std::string& indent, const std::string& coefficients) const {
    return indent + "camera_model: " + files.model + "\n" + indent + "intrinsics: [50, 50, 60, 40]\n" + indent +
           "resolution: [120, 80]\n" + indent + "distortion_model: " + files.lens + "\n" + indent + coefficients +
           ": [0, 0, 0, 0]\n";
  }

  std::vector<std::string> chain(const Files& files) const {
    const std::string all = camera(files, "  ", "distortion_coeffs");
    return {write("cam0:\n" + all + "cam1:\n" + all + "  T_cn_cnm1: [" + files.T_cn_cnm1 + "]\n")};
  }

  std::vector<std::string> sensors(const Files& files) const {
    const std::string all = camera(files, "", "distortion_coefficients") + "T_BS:\n  data: [1, 0, 0, ";
    const std::string end = ", 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n";
    return {write(all + "0" + end), write(all + "0.1" + end)};
  }

  std::vector<std::string> infos(const Files& files) const {
    const std::string all = "image_width: 120\nimage_height: 80\ndistortion_model: " + files.lens +
                            "\ncamera_matrix: {data: [50, 0, 60, 0, 50, 40, 0, 0, 1]}\n"
                            "distortion_coefficients: {data: [0, 0, 0, 0]}\n"
                            "rectification_matrix: {data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\nprojection_matrix: {data: [";
    return {write(all + "50, 0, 60, 0, 0, 50, 40, 0, 0, 0, 1, 0]}\n"), write(all + files.right_p + "]}\n")};
  }

  const TemporaryFolder folder_;
  mutable int written_ = 0;
};

TEST_F(CalibrationFile, IsKnownByWhatItHolds) {
  const StereoCamera camera = readCalibration(chain({}), 80.0).camera();
  EXPECT_NEAR(camera.baseline, 0.1, 1e-9);
  EXPECT_EQ(readCalibration(sensors({}), 80.0).camera(), camera);
  EXPECT_EQ(readCalibration(infos({}), 80.0).camera(), camera);
  EXPECT_EQ(readCalibration(infos({})).camera(), (StereoCamera{50.0, 50.0, 60.0, 40.0, 0.1, 120, 80}));
  EXPECT_TRUE(readCalibration(infos({})).raw(1).is_equidistant);
}

TEST_F(CalibrationFile, WhatIsWrongIsNamed) {
  Files other_lens, omni, swapped, short_matrix, mono;
  other_lens.lens = "fov";
  omni.model = "omni";
  swapped.T_cn_cnm1 = "[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]";
  short_matrix.T_cn_cnm1 = "[1, 0, 0, 0.1]";
  mono.right_p = "55, 0, 60, 0, 0, 50, 40, 0, 0, 0, 1, 0";
  const std::string formats = "one file of Kalibr's (cam0, cam1), or two";
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {chain(other_lens), "'fov' is not supported"},
      {sensors(other_lens), "'fov' is not supported"},
      {infos(other_lens), "'fov' is not supported"},
      {chain(omni), "camera_model 'omni'"},
      {chain(swapped), "swapped"},
      {chain(short_matrix), "not a rotation"},
      {infos(mono), "55.000 on the right"},
      {{infos({})[0]}, formats},
      {{infos({})[0], chain({})[0]}, formats},
      {{"nowhere.yaml"}, "nowhere.yaml': it does not exist"},
      {{write("[1, 2]")}, formats}};
  for (const auto& [files, words] : cases) expectError([&, wrong = files] { readCalibration(wrong); }, {words});
}

}  // namespace sdvo::test_stereo_rectification
