// OV2SLAM, without loop closing, over a drive: ov2slam_driver DRIVE POSES PARAMETERS RATE [THREADS]. PARAMETERS is a
// file of its parameters_files/, whose calibration is replaced by the drive's; pairs come at RATE, Hz, as its threads
// work beside each other. Its visualizer advertises topics, so a roscore has to run.
#include <ros/ros.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <thread>

#include "ov2slam.hpp"
#include "recorded_drive.hpp"

namespace {

void calibrate(SlamParams& parameters, const RecordedDrive& drive) {
  parameters.fxl_ = parameters.fxr_ = drive.fx;
  parameters.fyl_ = parameters.fyr_ = drive.fy;
  parameters.cxl_ = parameters.cxr_ = drive.cx;
  parameters.cyl_ = parameters.cyr_ = drive.cy;
  parameters.k1l_ = parameters.k2l_ = parameters.p1l_ = parameters.p2l_ = 0.0;
  parameters.k1r_ = parameters.k2r_ = parameters.p1r_ = parameters.p2r_ = 0.0;
  parameters.img_left_w_ = parameters.img_right_w_ = drive.width;
  parameters.img_left_h_ = parameters.img_right_h_ = drive.height;
  parameters.T_left_right_ = Sophus::SE3d(Eigen::Matrix3d::Identity(), Eigen::Vector3d(drive.baseline, 0.0, 0.0));
  parameters.bdo_stereo_rect_ = false;
}

void sleepUntil(double moment) {
  const double left = moment - wallSeconds();
  if (left > 0.0) usleep(static_cast<useconds_t>(1e6 * left));
}

}  // namespace

int main(int count, char** words) {
  if (count < 5) {
    std::fprintf(stderr, "usage: ov2slam_driver DRIVE POSES PARAMETERS RATE [THREADS]\n");
    return 2;
  }
  ros::init(count, words, "ov2slam_driver", ros::init_options::NoSigintHandler);
  ros::NodeHandle node("~");
  RecordedDrive drive(words[1]);  // OV2SLAM takes images that it may change
  const double rate = std::atof(words[4]);
  cv::setNumThreads(count > 5 ? std::atoi(words[5]) : 1);
  cv::FileStorage file(words[3], cv::FileStorage::READ);
  auto parameters = std::make_shared<SlamParams>(file);
  calibrate(*parameters, drive);
  parameters->buse_loop_closer_ = false;
  parameters->bforce_realtime_ = false;  // no pair is dropped

  auto visualizer = std::make_shared<RosVisualizer>(node);
  SlamManager slam(parameters, visualizer);
  std::thread thread(&SlamManager::run, &slam);
  while (!slam.bis_on_) usleep(1000);
  // Its threads poll: what they take while nothing comes is printed beside the rest.
  const double idle_cpu = cpuSeconds(), idle_wall = wallSeconds();
  usleep(3000000);
  const double idle_share = (cpuSeconds() - idle_cpu) / (wallSeconds() - idle_wall);

  const double cpu_before = cpuSeconds(), start = wallSeconds();
  for (size_t i = 0; i < drive.size(); ++i) {
    sleepUntil(start + i / rate);
    slam.addNewStereoImages(drive.stamps[i], drive.left[i], drive.right[i]);
  }
  const double patience = start + drive.size() / rate + 20.0;
  while (Logger::vkittipose_.size() < drive.size() && wallSeconds() < patience) usleep(10000);
  usleep(100000);
  const double cpu = cpuSeconds() - cpu_before, wall = wallSeconds() - start;

  FILE* poses = openToWrite(words[2]);
  for (const auto& pose : Logger::vkittipose_) {
    writePose(poses, [&](int row, int column) { return pose.Twc_[4 * row + column]; });
  }
  std::fclose(poses);
  std::printf("without what its idle threads take: CPU %.2f ms a pair\n",
              1e3 * (cpu - idle_share * wall) / drive.size());
  report("ov2slam", drive.size(), cpu, wall,
         static_cast<int>(drive.size() - std::min(drive.size(), Logger::vkittipose_.size())));
  std::fflush(stdout);
  _exit(0);  // its threads do not end
}
