#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>

#include "../said.hpp"
#include "../temporary_folder.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

namespace sdvo::test_kitti_writer {

namespace fs = std::filesystem;

class KittiWriterTest : public testing::Test {
 protected:
  cv::Mat image(int side, int i) const { return cv::Mat(30, 40, CV_8U, cv::Scalar(10 * i + side)); }

  void write(KittiWriter& writer, const Trajectory& poses = {}) const {
    for (int i = 0; i < 2; ++i)
      for (int side = 0; side < 2; ++side) writer.writeImage(side, i, image(side, i));
    writer.finish(camera_, {0, 100000001}, poses);
  }

  std::string errorOfWriter() const {
    return errorOf([this] { KittiWriter{directory_}; });
  }

  const StereoCamera camera_{123.0 / 7.0, 18.5, 20.25, 14.75, 0.1203, 40, 30};
  const TemporaryFolder folder_;
  const fs::path root_ = folder_.path();
  const std::string directory_ = (root_ / "drive").string();
};

TEST_F(KittiWriterTest, WhatIsWrittenIsReadBack) {
  Trajectory poses(2, Eigen::Isometry3d::Identity());
  poses[1] = Eigen::Translation3d(0.5, -0.25, 2.0);
  KittiWriter writer(directory_ + "/");
  write(writer, poses);

  const KittiSequence sequence(directory_);
  ASSERT_EQ(sequence.size(), 2);
  EXPECT_NEAR(sequence.camera().fx, camera_.fx, 1e-11);
  EXPECT_NEAR(sequence.camera().fy, camera_.fy, 1e-11);
  EXPECT_NEAR(sequence.camera().cx, camera_.cx, 1e-11);
  EXPECT_NEAR(sequence.camera().cy, camera_.cy, 1e-11);
  EXPECT_NEAR(sequence.camera().baseline, camera_.baseline, 1e-11);
  EXPECT_EQ(sequence.camera().width, camera_.width);
  EXPECT_EQ(sequence.camera().height, camera_.height);
  EXPECT_EQ(sequence.stamp(0), 0);
  EXPECT_EQ(sequence.stamp(1), 100000001);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(cv::norm(sequence.load(i).left, image(0, i), cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(sequence.load(i).right, image(1, i), cv::NORM_INF), 0.0);
  }
  const auto file = findKittiPoses(directory_);
  ASSERT_TRUE(file);
  EXPECT_TRUE(readKittiPoses(*file)[1].isApprox(poses[1]));
}

TEST_F(KittiWriterTest, TheNameAppearsWithTheWholeSequence) {
  {
    KittiWriter writer(directory_);
    writer.writeImage(0, 0, image(0, 0));
    EXPECT_FALSE(fs::exists(directory_));
    EXPECT_TRUE(fs::exists(directory_ + ".part"));
    EXPECT_TRUE(contains(errorOfWriter(), "left from an interrupted run"));
  }  // something failed
  EXPECT_TRUE(fs::is_empty(root_));
  KittiWriter writer(directory_);
  write(writer);
  EXPECT_TRUE(fs::exists(directory_));
  EXPECT_FALSE(fs::exists(directory_ + ".part"));
  EXPECT_FALSE(fs::exists(directory_ + "/poses.txt"));
}

TEST_F(KittiWriterTest, NothingIsOverwritten) {
  fs::create_directory(directory_);
  EXPECT_EQ(errorOfWriter(), "no error");  // it is empty
  std::ofstream(directory_ + "/notes.txt") << "mine";
  EXPECT_TRUE(contains(errorOfWriter(), "not empty"));
  EXPECT_FALSE(fs::exists(directory_ + ".part"));
}

TEST_F(KittiWriterTest, RefusesPosesOfAnotherNumberAndImagesThatCannotBeWritten) {
  KittiWriter writer(directory_);
  EXPECT_THROW(writer.finish(camera_, {0, 1}, Trajectory(1, Eigen::Isometry3d::Identity())), std::invalid_argument);
  EXPECT_THROW(writer.writeImage(2, 0, image(0, 0)), std::runtime_error);  // there is no image_2
}

}  // namespace sdvo::test_kitti_writer
