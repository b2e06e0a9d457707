#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "../../src/ros/files/output_files.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "../temporary_folder.hpp"
#include "message_samples.hpp"

namespace sdvo::test_trajectory_file {

namespace fs = std::filesystem;

class TrajectoryFile : public ::testing::Test {
 protected:
  TrajectoryFile() {
    T_base_camera_.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
    add(1, 5, 0.0);
    add(2, 123456789, 1.5);
  }

  /// `x` m ahead of the origin, turned by 180 degrees about the vertical.
  void add(std::uint32_t seconds, std::uint32_t nanoseconds, double x) {
    geometry_msgs::PoseStamped pose;
    pose.header.stamp = ros::Time(seconds, nanoseconds);
    pose.pose.position.x = x;
    pose.pose.orientation.z = 1.0;
    poses_.poses.push_back(pose);
  }

  void expectNoPartialFile() const {
    for (const auto& entry : fs::directory_iterator(directory_)) EXPECT_EQ(entry.path(), directory_ / "file.txt");
  }

  std::string save(const std::string& format) {
    const std::string path = (directory_ / "file.txt").string();
    saveTrajectory(poses_, T_base_camera_, format, path);
    expectNoPartialFile();
    std::stringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }

  std::string refusal(const std::string& path, const std::string& format = "tum") {
    EXPECT_THROW(saveTrajectory(poses_, T_base_camera_, format, path), std::runtime_error) << path;
    expectNoPartialFile();
    return errorOf([&] { saveTrajectory(poses_, T_base_camera_, format, path); });
  }

  const TemporaryFolder folder_;
  const fs::path directory_ = folder_.path();
  nav_msgs::Path poses_;
  Eigen::Isometry3d T_base_camera_ = Eigen::Isometry3d::Identity();
};

TEST_F(TrajectoryFile, TumHasStampPositionAndQuaternion) {
  EXPECT_EQ(save("tum"), "1.000000005 0 0 0 0 0 1 0\n2.123456789 1.5 0 0 0 0 1 0\n");
}

TEST_F(TrajectoryFile, KittiIsTheCamerasMotionFromItsFirstPose) {
  // The base turned round and went 1.5 m ahead in odom: backwards for itself and for the camera.
  EXPECT_EQ(save("kitti"), "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 -1.5\n");
}

TEST_F(TrajectoryFile, ReplacesAFile) {
  std::ofstream(directory_ / "file.txt") << "much longer than what will be written into it, by far, and then some more";
  EXPECT_EQ(save("tum").substr(0, 12), "1.000000005 ");
}

TEST(InRosHome, RelativePathsLeadFromThereOn) {
  const char* before = std::getenv("ROS_HOME");
  const std::string kept = before ? before : "";
  ::setenv("ROS_HOME", "/ros_home", 1);
  EXPECT_EQ(inRosHome("maps/site.bag"), "/ros_home/maps/site.bag");
  EXPECT_EQ(inRosHome("/site.bag"), "/site.bag");
  EXPECT_EQ(inRosHome("/maps/./new/../site.bag"), "/maps/site.bag") << "each file has one spelling";
  EXPECT_EQ(inRosHome(""), "");
  ::unsetenv("ROS_HOME");
  EXPECT_EQ(inRosHome("site.bag"), std::string(std::getenv("HOME")) + "/.ros/site.bag");
  if (before) ::setenv("ROS_HOME", kept.c_str(), 1);
}

TEST_F(TrajectoryFile, RefusesWhatIsNoFileOfTheUsers) {
  EXPECT_TRUE(contains(refusal("file.txt"), "absolute"));
  EXPECT_TRUE(contains(refusal(""), "absolute"));
  EXPECT_TRUE(contains(refusal(directory_.string()), "no regular file"));
  EXPECT_TRUE(contains(refusal("/dev/null"), "no regular file"));
  EXPECT_TRUE(contains(refusal((directory_ / "missing" / "file.txt").string()), "No such file or directory"));
  EXPECT_TRUE(contains(refusal("/proc/sys/file.txt"), "cannot be written"));
  EXPECT_TRUE(contains(refusal((directory_ / "file.txt").string(), "csv"), "neither tum nor kitti"));
  EXPECT_FALSE(fs::exists(directory_ / "file.txt"));
}

}  // namespace sdvo::test_trajectory_file
