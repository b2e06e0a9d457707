// rtabmap's stereo odometry, as its node stereo_odometry runs it, over a drive:
//   rtabmap_driver DRIVE POSES COVARIANCES.csv [--threads N] [--reset N] [--exposure] [GROUP/NAME VALUE …]
// --reset: Odom/ResetCountdown (default 0: never by itself). --exposure: equal gains of both images, as its tool for
// EuRoC has it; the node has no such thing. A pair that is lost keeps the last pose.
#include <rtabmap/core/Odometry.h>
#include <rtabmap/core/OdometryInfo.h>
#include <rtabmap/core/Parameters.h>
#include <rtabmap/core/StereoCameraModel.h>
#include <rtabmap/utilite/ULogger.h>
#include <rtabmap/utilite/UStl.h>

#include <memory>
#include <opencv2/imgproc.hpp>
#include <opencv2/stitching/detail/exposure_compensate.hpp>

#include "recorded_drive.hpp"

namespace {

struct Settings {
  rtabmap::ParametersMap parameters;
  int threads = 1;
  int countdown = 0;  // lost pairs until a reset; 0: never
  bool has_equal_gains = false;
};

// Defaults as OdometryROS::onInit takes them.
Settings parse(int count, char** words) {
  using rtabmap::Parameters;
  Settings settings;
  rtabmap::ParametersMap& parameters = settings.parameters;
  parameters = Parameters::getDefaultOdometryParameters(true, true, false);
  parameters.insert(*Parameters::getDefaultParameters().find(Parameters::kRtabmapImagesAlreadyRectified()));
  for (int i = 4; i < count; ++i) {
    const std::string name = words[i];
    if (name == "--exposure") {
      settings.has_equal_gains = true;
      continue;
    }
    const bool is_known = name == "--threads" || name == "--reset" || parameters.count(name);
    if (!is_known || i + 1 == count) {
      std::fprintf(stderr, "error: no parameter %s, or no value of it\n", name.c_str());
      std::exit(2);
    }
    const char* value = words[++i];
    if (name == "--threads") {
      settings.threads = std::atoi(value);
    } else if (name == "--reset") {
      settings.countdown = std::atoi(value);
    } else {
      parameters[name] = value;
    }
  }
  parameters[Parameters::kOdomResetCountdown()] = "0";  // the driver counts, as the node does
  uInsert(parameters, rtabmap::ParametersPair(Parameters::kRegStrategy(), "0"));
  return settings;
}

void equaliseGains(cv::Mat& left, cv::Mat& right) {
  using cv::detail::ExposureCompensator;
  const auto compensator = ExposureCompensator::createDefault(ExposureCompensator::GAIN);
  const std::vector<cv::Point> corners(2);
  const cv::UMat mask(left.size(), CV_8UC1, cv::Scalar(255));
  const std::vector<cv::UMat> images{left.getUMat(cv::ACCESS_READ), right.getUMat(cv::ACCESS_READ)}, masks(2, mask);
  compensator->feed(corners, images, masks);
  cv::Mat new_left = left.clone(), new_right = right.clone();
  compensator->apply(0, corners[0], new_left, mask);
  compensator->apply(1, corners[1], new_right, mask);
  left = new_left;
  right = new_right;
}

// A line for each pair: counts, and the variances of the motion in rtabmap's base frame, m² and rad²; -1 where there
// are none.
void writeLine(FILE* file, size_t pair, bool is_lost, double cpu, const rtabmap::OdometryInfo& info) {
  std::fprintf(file, "%zu,%d,%.3f,%d,%d,%d,%d,%d,%.3f", pair, is_lost, 1e3 * cpu, info.features, info.reg.matches,
               info.reg.inliers, static_cast<int>(info.keyFrameAdded), info.localMapSize, 1e3 * info.localBundleTime);
  const cv::Mat& covariance = info.reg.covariance;
  for (int k = 0; k < 6; ++k) std::fprintf(file, ",%.6g", covariance.empty() ? -1.0 : covariance.at<double>(k, k));
  std::fprintf(file, "\n");
}

}  // namespace

int main(int count, char** words) {
  if (count < 4) {
    std::fprintf(stderr,
                 "usage: rtabmap_driver DRIVE POSES COVARIANCES.csv [--threads N] [--reset N] [--exposure] "
                 "[GROUP/NAME VALUE ...]\n");
    return 2;
  }
  ULogger::setType(ULogger::kTypeConsole);
  ULogger::setLevel(ULogger::kError);
  const Settings settings = parse(count, words);
  if (settings.threads > 0) cv::setNumThreads(settings.threads);
  RecordedDrive drive(words[1]);
  const rtabmap::Transform optical = rtabmap::CameraModel::opticalRotation();
  const rtabmap::StereoCameraModel model(drive.fx, drive.fy, drive.cx, drive.cy, drive.baseline, optical,
                                         cv::Size(drive.width, drive.height));
  const std::unique_ptr<rtabmap::Odometry> odometry(rtabmap::Odometry::create(settings.parameters));

  FILE *poses = openToWrite(words[2]), *covariances = openToWrite(words[3]);
  std::fprintf(covariances,
               "pair,lost,cpu_ms,features,matches,inliers,keyframe,map,ba_ms,vx,vy,vz,vroll,vpitch,vyaw\n");
  rtabmap::Transform last = rtabmap::Transform::getIdentity();
  int lost = 0, left_until_reset = settings.countdown;
  double cpu = 0.0, wall = 0.0;
  for (size_t i = 0; i < drive.size(); ++i) {
    rtabmap::OdometryInfo info;
    const double cpu_before = cpuSeconds(), wall_before = wallSeconds();
    if (settings.has_equal_gains) equaliseGains(drive.left[i], drive.right[i]);
    rtabmap::SensorData data(drive.left[i], drive.right[i], model, static_cast<int>(i + 1), drive.stamps[i]);
    const rtabmap::Transform pose = odometry->process(data, rtabmap::Transform(), &info);
    const double cpu_of_pair = cpuSeconds() - cpu_before;
    cpu += cpu_of_pair;
    wall += wallSeconds() - wall_before;
    if (!pose.isNull()) {
      last = pose;
      left_until_reset = settings.countdown;
    } else {
      ++lost;
      if (settings.countdown > 0 && --left_until_reset == 0) {
        odometry->reset(odometry->getPose());
        left_until_reset = settings.countdown;
      }
    }
    const rtabmap::Transform in_optical_frame = optical.inverse() * last * optical;
    writePose(poses, [&](int row, int column) { return in_optical_frame.data()[4 * row + column]; });
    writeLine(covariances, i, pose.isNull(), cpu_of_pair, info);
  }
  std::fclose(poses);
  std::fclose(covariances);
  report("rtabmap", drive.size(), cpu, wall, lost);
}
