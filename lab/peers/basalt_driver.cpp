// Basalt's visual odometry, without IMU and mapper, over a drive: basalt_driver DRIVE POSES CONFIG [THREADS]. CONFIG is
// a file of Basalt's data/, such as kitti_config.json.
#include <basalt/optical_flow/optical_flow.h>
#include <basalt/utils/vio_config.h>
#include <basalt/vi_estimator/sqrt_keypoint_vo.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <memory>

#include "recorded_drive.hpp"

namespace {

basalt::Calibration<double> calibrationOf(const RecordedDrive& drive) {
  basalt::Calibration<double> calibration;
  for (int side = 0; side < 2; ++side) {
    basalt::GenericCamera<double> camera;
    camera.variant = basalt::PinholeCamera<double>(Eigen::Vector4d(drive.fx, drive.fy, drive.cx, drive.cy));
    calibration.intrinsics.push_back(camera);
    calibration.T_i_c.push_back(
        Sophus::SE3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(side * drive.baseline, 0.0, 0.0)));
    calibration.resolution.push_back(Eigen::Vector2i(drive.width, drive.height));
  }
  return calibration;
}

// Basalt's images have 16 bits.
std::shared_ptr<basalt::ManagedImage<uint16_t>> widened(const cv::Mat& image) {
  auto wide = std::make_shared<basalt::ManagedImage<uint16_t>>(image.cols, image.rows);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) (*wide)(x, y) = static_cast<uint16_t>(image.at<uint8_t>(y, x) << 8);
  }
  return wide;
}

std::vector<basalt::OpticalFlowInput::Ptr> inputsOf(const RecordedDrive& drive) {
  std::vector<basalt::OpticalFlowInput::Ptr> inputs;
  for (size_t i = 0; i < drive.size(); ++i) {
    auto input = std::make_shared<basalt::OpticalFlowInput>();
    input->t_ns = static_cast<int64_t>(drive.stamps[i] * 1e9) + 1000000000;  // zero is no stamp
    input->img_data.resize(2);
    for (int side = 0; side < 2; ++side) {
      input->img_data[side].img = widened(side == 0 ? drive.left[i] : drive.right[i]);
      input->img_data[side].exposure = 0;
    }
    inputs.push_back(input);
  }
  return inputs;
}

}  // namespace

int main(int count, char** words) {
  if (count < 4) {
    std::fprintf(stderr, "usage: basalt_driver DRIVE POSES CONFIG [THREADS]\n");
    return 2;
  }
  const RecordedDrive drive(words[1]);
  cv::setNumThreads(1);
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, count > 4 ? std::atoi(words[4]) : 1);
  basalt::VioConfig config;
  config.load(words[3]);
  config.vio_enforce_realtime = false;  // no pair is dropped
  basalt::Calibration<double> calibration = calibrationOf(drive);
  const auto inputs = inputsOf(drive);

  auto flow = basalt::OpticalFlowFactory::getOpticalFlow(config, calibration);
  auto odometry = std::make_shared<basalt::SqrtKeypointVoEstimator<float>>(calibration, config);
  odometry->initialize(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  flow->output_queue = &odometry->vision_data_queue;
  tbb::concurrent_bounded_queue<basalt::PoseVelBiasState<double>::Ptr> states;
  odometry->out_state_queue = &states;

  FILE* poses = openToWrite(words[2]);
  const double cpu = cpuSeconds(), wall = wallSeconds();
  int followed = 0;
  for (const auto& input : inputs) {
    flow->input_queue.push(input);
    basalt::PoseVelBiasState<double>::Ptr state;
    states.pop(state);
    if (!state) break;
    ++followed;
    writePose(poses, state->T_w_i.matrix());
  }
  report("basalt", drive.size(), cpuSeconds() - cpu, wallSeconds() - wall, static_cast<int>(drive.size()) - followed);
  std::fclose(poses);
  std::fflush(stdout);
  _exit(0);  // Basalt's threads wait for more pairs
}
