// fovis over a drive: fovis_driver DRIVE POSES [OPTION=VALUE …], options of fovis::VisualOdometryOptions.
#include <fovis.hpp>

#include "recorded_drive.hpp"

namespace {

fovis::CameraIntrinsicsParameters intrinsics(const RecordedDrive& drive) {
  fovis::CameraIntrinsicsParameters parameters;  // without distortion
  parameters.width = drive.width;
  parameters.height = drive.height;
  parameters.fx = drive.fx;
  parameters.fy = drive.fy;
  parameters.cx = drive.cx;
  parameters.cy = drive.cy;
  return parameters;
}

}  // namespace

int main(int count, char** words) {
  if (count < 3) {
    std::fprintf(stderr, "usage: fovis_driver DRIVE POSES [OPTION=VALUE ...]\n");
    return 2;
  }
  cv::setNumThreads(1);
  const RecordedDrive drive(words[1]);
  fovis::VisualOdometryOptions options = fovis::VisualOdometry::getDefaultOptions();
  for (int i = 3; i < count; ++i) {
    const std::string word = words[i];
    const size_t equals = word.find('=');
    if (equals == std::string::npos || !options.count(word.substr(0, equals))) {
      std::fprintf(stderr, "error: fovis has no option %s\n", word.c_str());
      return 2;
    }
    options[word.substr(0, equals)] = word.substr(equals + 1);
  }

  fovis::StereoCalibrationParameters parameters{};
  parameters.left_parameters = intrinsics(drive);
  parameters.right_parameters = intrinsics(drive);
  parameters.right_to_left_translation[0] = -drive.baseline;
  parameters.right_to_left_rotation[0] = 1.0;  // quaternion, w first
  fovis::StereoCalibration calibration(parameters);
  fovis::StereoDepth depth(&calibration, options);
  fovis::Rectification rectification(calibration.getRectifiedParameters());
  fovis::VisualOdometry odometry(&rectification, options);

  FILE* poses = openToWrite(words[2]);
  int lost = 0;
  double cpu = 0.0, wall = 0.0;
  for (size_t i = 0; i < drive.size(); ++i) {
    const double cpu_before = cpuSeconds(), wall_before = wallSeconds();
    depth.setRightImage(drive.right[i].data);
    odometry.processFrame(drive.left[i].data, &depth);
    cpu += cpuSeconds() - cpu_before;
    wall += wallSeconds() - wall_before;
    lost += i > 0 && odometry.getMotionEstimateStatus() != fovis::SUCCESS;
    writePose(poses, odometry.getPose().matrix());
  }
  std::fclose(poses);
  report("fovis", drive.size(), cpu, wall, lost);
}
