#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "../../src/data/euroc_dataset.hpp"
#include "../said.hpp"
#include "../temporary_folder.hpp"

namespace sdvo::test_euroc_dataset {

namespace fs = std::filesystem;

/// mav0 with two pairs of 120x80 px and one more left image, of cameras 0.2 m apart.
class EurocDataset : public testing::Test {
 protected:
  void SetUp() override {
    writeCamera("cam0", 0.0, {1000, 1050, 1100});
    writeCamera("cam1", 0.2, {1000, 1100});
  }

  void writeCamera(const std::string& camera, double place, const std::vector<int>& stamps) const {
    fs::create_directories(root_ / camera / "data");
    writeSensor(camera, place, "120, 80");
    std::ofstream list(root_ / camera / "data.csv");
    list << "#timestamp [ns],filename\r\n";
    for (const int stamp : stamps) {
      list << stamp << "," << stamp << ".png\r\n";
      cv::imwrite((root_ / camera / "data" / (std::to_string(stamp) + ".png")).string(),
                  cv::Mat(80, 120, CV_8UC1, cv::Scalar(camera == "cam0" ? 10 : 20)));
    }
  }

  /// The camera's x points along the body's z, on which it has its `place` in m.
  void writeSensor(const std::string& camera, double place, const std::string& resolution) const {
    std::ofstream(root_ / camera / "sensor.yaml")
        << "T_BS:\n  data: [0, 0, 1, 0,  0, -1, 0, 0.5,  1, 0, 0, " << place << ",  0, 0, 0, 1]\n"
        << "resolution: [" << resolution << "]\ncamera_model: pinhole\nintrinsics: [100, 110, 60, 40]\n"
        << "distortion_model: radial-tangential\ndistortion_coefficients: [-0.1, 0.01, 0.001, 0.002]\n";
  }

  const TemporaryFolder folder_;
  const fs::path root_ = folder_.path();
};

TEST_F(EurocDataset, PairsAreThoseThatBothCamerasTook) {
  const EurocSequence sequence(root_.string());
  ASSERT_EQ(sequence.size(), 2);
  EXPECT_EQ(sequence.unpaired(), 1);
  EXPECT_EQ(sequence.stamp(0), 1000);
  EXPECT_EQ(sequence.stamp(1), 1100);
  const ImagePair pair = sequence.load(1);
  EXPECT_EQ(pair.left.at<std::uint8_t>(5, 5), 10);
  EXPECT_EQ(pair.right.at<std::uint8_t>(5, 5), 20);
}

TEST_F(EurocDataset, CalibrationIsThatOfTheFilesAndRectified) {
  const StereoRectification rectification = EurocSequence(root_.string()).rectification();
  const RawCamera& left = rectification.raw(0);
  EXPECT_EQ(left.K, cv::Matx33d(100, 0, 60, 0, 110, 40, 0, 0, 1));
  EXPECT_EQ(left.D, (std::vector<double>{-0.1, 0.01, 0.001, 0.002}));
  // The cameras' axes agree already, so there is nothing to turn.
  for (const int side : {0, 1}) EXPECT_LT(cv::norm(rectification.rotation(side) - cv::Matx33d::eye()), 1e-9);
  const StereoCamera& camera = rectification.camera();
  EXPECT_NEAR(camera.baseline, 0.2, 1e-9);
  EXPECT_EQ(camera.width, 120);
  EXPECT_EQ(camera.height, 80);
  EXPECT_GT(camera.fx, 50.0);
  EXPECT_NEAR(EurocSequence(root_.string(), {}, 90.0).rectification().camera().fx, 60.0, 1e-9);
}

/// TUM-VI's lenses, in Kalibr's file beside mav0.
TEST_F(EurocDataset, CalibrationOfTumVi) {
  fs::create_directories(root_ / "mav0");
  for (const std::string camera : {"cam0", "cam1"}) {
    fs::remove(root_ / camera / "sensor.yaml");
    fs::rename(root_ / camera, root_ / "mav0" / camera);
  }
  const std::string mav0 = (root_ / "mav0").string();
  EXPECT_TRUE(contains(errorOf([&] { EurocSequence{mav0}; }), "sensor.yaml"));
  fs::create_directories(root_ / "dso");
  const std::string camera =
      "  camera_model: pinhole\n  intrinsics: [45, 45, 60, 40]\n  resolution: [120, 80]\n"
      "  distortion_model: equidistant\n  distortion_coeffs: [0.003, 0.001, -0.002, 0.0002]\n";
  const fs::path chain = root_ / "dso" / "camchain.yaml";
  std::ofstream(chain) << "cam0:\n"
                       << camera << "cam1:\n"
                       << camera << "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
  const EurocSequence sequence(mav0);
  EXPECT_NEAR(sequence.rectification().camera().baseline, 0.1, 1e-9);
  EXPECT_EQ(sequence.loadRectified(0).left.size(), cv::Size(120, 80));
  fs::rename(chain, root_ / "elsewhere.yaml");
  EXPECT_EQ(EurocSequence(mav0, {(root_ / "elsewhere.yaml").string()}).rectification().camera(),
            sequence.rectification().camera());
}

TEST_F(EurocDataset, PosesAreRelativeToTheFirst) {
  std::string problem;
  const EurocSequence sequence(root_.string());
  EXPECT_TRUE(sequence.rectifiedPoses(problem).empty());
  EXPECT_TRUE(contains(problem, "there is no"));
  std::ofstream(root_ / "cam0_ground_truth.txt") << "1000 1 0 0 5 0 1 0 6 0 0 1 7\n1050 1 0 0 9 0 1 0 9 0 0 1 9\n";
  EXPECT_TRUE(sequence.rectifiedPoses(problem).empty());
  EXPECT_TRUE(contains(problem, "no pose at 1100"));
  std::ofstream(root_ / "cam0_ground_truth.txt") << "1000 1 0 0 5 0 1 0 6 0 0 1 7\n1100 1 0 0 5 0 1 0 6 0 0 1 8.5\n";
  const Trajectory poses = sequence.rectifiedPoses(problem);
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_TRUE(poses[0].isApprox(Eigen::Isometry3d::Identity()));
  EXPECT_TRUE(poses[1].translation().isApprox(Eigen::Vector3d(0, 0, 1.5)));
}

TEST_F(EurocDataset, WhatDoesNotHoldTogetherIsNamed) {
  const std::vector<std::pair<std::function<void()>, std::string>> damages = {
      {[this] { writeSensor("cam1", -0.2, "120, 80"); }, "swapped"},
      {[this] { writeSensor("cam1", 0.2, "100, 80"); }, "resolution"},
      {[this] { writeSensor("cam0", 0.0, "100, 80"); }, "1000.png"},
      {[this] { writeCamera("cam0", 0.0, {1001}); }, "resolution"},
      {[this] { writeCamera("cam1", 0.2, {1000}); }, "no stamp in common"},
      {[this] { writeCamera("cam1", 0.2, {}); }, "lists no images"},
      {[this] { fs::remove_all(root_ / "cam1"); }, "cam1/sensor.yaml': it does not exist"}};
  for (const auto& [damage, words] : damages) {
    damage();
    expectError([this] { EurocSequence(root_.string()).load(0); }, {words});
  }
}

}  // namespace sdvo::test_euroc_dataset
