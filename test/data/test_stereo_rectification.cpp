#include <gtest/gtest.h>

#include <Eigen/Core>
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

/// A rig of 120x80 px, f 50 px, 0.1 m, as the programs of others write it.
TEST_F(CalibrationFile, OfOtherProgramsGivesTheSameRig) {
  const auto matrix = [](const std::string& name, int rows, int columns, const std::string& data) {
    return name + ": !!opencv-matrix\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(columns) +
           "\n  dt: d\n  data: [" + data + "]\n";
  };
  const std::string yaml = "%YAML:1.0\n---\n", k = "50, 0, 60, 0, 50, 40, 0, 0, 1", none = "0, 0, 0, 0",
                    one = "1, 0, 0, 0, 1, 0, 0, 0, 1", p1 = "50, 0, 60, 0, 0, 50, 40, 0, 0, 0, 1, 0",
                    p2 = "50, 0, 60, -5, 0, 50, 40, 0, 0, 0, 1, 0";
  const auto pose = [](double x) { return "1, 0, 0, " + std::to_string(x) + ", 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1"; };
  const auto message = [&](const std::string& p) {
    return "header:\n  seq: 1\nheight: 80\nwidth: 120\ndistortion_model: \"plumb_bob\"\nD: [" + none + ", 0]\nK: [" +
           k + "]\nR: [" + one + "]\nP: [" + p + "]\n---\n";
  };
  const auto ost = [&](const std::string& side, const std::string& tx) {
    return "# oST version 5.0 parameters\n\n[image]\n\nwidth\n120\n\nheight\n80\n\n[narrow_stereo/" + side +
           "]\n\ncamera matrix\n50 0 60\n0 50 40\n0 0 1\n\ndistortion\n0 0 0 0 0\n\nrectification\n1 0 0\n0 1 0\n0 0 "
           "1\n\nprojection\n50 0 60 " +
           tx + "\n0 50 40 0\n0 0 1 0\n\n";
  };
  const auto kalibr = [&](double x) {
    return camera({"radtan"}, "  ", "distortion_coeffs") + "  T_cam_imu: [" + pose(x) + "]\n";
  };
  const auto orb3 = [](const std::string& n) {
    return "Camera" + n + ".fx: 50\nCamera" + n + ".fy: 50\nCamera" + n + ".cx: 60\nCamera" + n + ".cy: 40\n";
  };
  const std::string orb_size = "Camera.width: 120\nCamera.height: 80\n";
  const auto vins = [&](const std::string& name) {
    const std::string path = (folder_.path() / name).string();
    std::ofstream(path) << yaml << "model_type: PINHOLE\nimage_width: 120\nimage_height: 80\n"
                        << "distortion_parameters: {k1: 0, k2: 0, p1: 0, p2: 0}\n"
                        << "projection_parameters: {fx: 50, fy: 50, cx: 60, cy: 40}\n";
    return path;
  };
  const std::string vins0 = vins("cam0_pinhole.yaml"), vins1 = vins("cam1_pinhole.yaml"),
                    vins_config = write(yaml + matrix("body_T_cam0", 4, 4, pose(0.0)) +
                                        matrix("body_T_cam1", 4, 4, pose(0.1)) +
                                        "cam0_calib: cam0_pinhole.yaml\ncam1_calib: cam1_pinhole.yaml\n");
  const std::string intrinsics = matrix("M1", 3, 3, k) + matrix("D1", 1, 4, none) + matrix("M2", 3, 3, k) +
                                 matrix("D2", 1, 4, none),
                    rectified = matrix("R1", 3, 3, one) + matrix("R2", 3, 3, one) + matrix("P1", 3, 4, p1) +
                                matrix("P2", 3, 4, p2),
                    pair = matrix("R", 3, 3, one) + matrix("T", 3, 1, "-0.1, 0, 0");
  std::string xml = "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>120</image_width><image_height>80</image_height>";
  for (const auto& [name, rows, data] : {std::tuple("M1", 3, k), {"D1", 1, none}, {"M2", 3, k}, {"D2", 1, none},
                                         {"R", 3, one}, {"T", 3, std::string("-0.1, 0, 0")}}) {
    std::string blanks = data;
    blanks.erase(std::remove(blanks.begin(), blanks.end(), ','), blanks.end());
    const auto count = static_cast<int>(std::count(blanks.begin(), blanks.end(), ' ')) + 1;
    xml += std::string("<") + name + " type_id=\"opencv-matrix\"><rows>" + std::to_string(rows) + "</rows><cols>" +
           std::to_string(count / rows) + "</cols><dt>d</dt><data>" + blanks + "</data></" + name + ">";
  }
  const auto orb2 = [&](const std::string& side, const std::string& p) {
    return side + ".height: 80\n" + side + ".width: 120\n" + matrix(side + ".D", 1, 5, none + ", 0") +
           matrix(side + ".K", 3, 3, k) + matrix(side + ".R", 3, 3, one) + matrix(side + ".P", 3, 4, p);
  };
  const std::vector<std::pair<const char*, std::vector<std::string>>> cases = {
      {"T_cam_imu", {write("cam0:\n" + kalibr(0.0) + "cam1:\n" + kalibr(-0.1))}},
      {"T_cam_imu in two files", {write("cam0:\n" + kalibr(0.0)), write("cam0:\n" + kalibr(-0.1))}},
      {"rostopic", {write(message(p1)), write(message(p2))}},
      {"ost.txt", {write(ost("left", "0") + ost("right", "-5"))}},
      {"ost.txt, two", {write(ost("left", "0")), write(ost("right", "-5"))}},
      {"OpenCV", {write(yaml + intrinsics), write(yaml + rectified + pair)}},
      {"OpenCV in one file", {write(yaml + intrinsics + pair)}},
      {"OpenCV's XML", {write(xml + "</opencv_storage>\n")}},
      {"ORB-SLAM2", {write("%YAML:1.0\nCamera.fx: 1\nCamera.bf: 7\n" + orb2("LEFT", p1) + orb2("RIGHT", p2))}},
      {"ORB-SLAM2, rectified", {write(yaml + orb3("") + orb_size + "Camera.bf: 5.0\n")}},
      {"ORB-SLAM3", {write(yaml + "Camera.type: \"PinHole\"\n" + orb3("1") + orb3("2") + orb_size +
                           matrix("Stereo.T_c1_c2", 4, 4, pose(0.1)))}},
      {"ORB-SLAM3, rectified",
       {write(yaml + "Camera.type: \"Rectified\"\n" + orb3("1") + orb_size + "Stereo.b: 0.1\n")}},
      {"VINS", {vins_config}},
      {"VINS, three files", {vins_config, vins0, vins1}}};
  for (const auto& [name, files] : cases) {
    SCOPED_TRACE(name);
    const std::string error = errorOf([&, read = files] { readCalibration(read, 80.0, {120, 80}); });
    ASSERT_EQ(error, "no error");
    EXPECT_NEAR(readCalibration(files, 80.0, {120, 80}).camera().baseline, 0.1, 1e-6);
    EXPECT_EQ(readCalibration(files, 80.0, {120, 80}).raw(1).K(0, 2), 60.0);
  }
  EXPECT_TRUE(readCalibration({vins_config}, 80.0).T_body_left().isApprox(Eigen::Isometry3d::Identity()));
  for (const auto& [files, words] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{write(yaml + intrinsics + pair)}, "no 'image_"},
           {{vins0, vins1}, "pose between them"},
           {{write(ost("left", "0"))}, "one camera alone"},
           {{write("cam0:\n" + kalibr(0.0) + "cam1:\n" + camera({"radtan"}, "  ", "distortion_coeffs"))}, "T_cam_imu"},
           {{write("cam0:\n\tcamera_model: pinhole\n")}, "tabs"},
           {{write("<!DOCTYPE html><html>")}, "an HTML page"},
           {{write("version https://git-lfs.github.com/spec/v1\noid sha256:0\n")}, "git lfs pull"}})
    expectError([&, wrong = files] { readCalibration(wrong); }, {words});
}

TEST_F(CalibrationFile, WhatIsWrongIsNamed) {
  Files other_lens, omni, swapped, short_matrix, mono;
  other_lens.lens = "fov";
  omni.model = "omni";
  swapped.T_cn_cnm1 = "[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]";
  short_matrix.T_cn_cnm1 = "[1, 0, 0, 0.1]";
  mono.right_p = "55, 0, 60, 0, 0, 50, 40, 0, 0, 0, 1, 0";
  const std::string formats = "Kalibr's camera chain (cam0, cam1)";
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {chain(other_lens), "'fov' is not supported"},
      {sensors(other_lens), "'fov' is not supported"},
      {infos(other_lens), "'fov' is not supported"},
      {chain(omni), "camera_model 'omni'"},
      {chain(swapped), "swapped"},
      {chain(short_matrix), "'T_cn_cnm1' of 16, found 4"},
      {infos(mono), "55.000 on the right"},
      {{infos({})[1], infos({})[0]}, "swapped"},
      {{infos({})[0]}, formats},
      {{infos({})[0], chain({})[0]}, formats},
      {{"nowhere.yaml"}, "nowhere.yaml': it does not exist"},
      {{write("[1, 2]")}, formats}};
  for (const auto& [files, words] : cases) expectError([&, wrong = files] { readCalibration(wrong); }, {words});
}

}  // namespace sdvo::test_stereo_rectification
