#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <stereo_descriptor_vo/data/kitti_dataset.hpp>
#include <stereo_descriptor_vo/front_end/feature_extractor.hpp>
#include <stereo_descriptor_vo/odometry/visual_odometry.hpp>

/// Stereo odometry without ROS: calib.txt of KITTI, then pairs of rectified images, 0.1 s apart. Prints the position of
/// the left camera at each pair, m.
int main(int argc, char** argv) {
  if (argc < 4 || argc % 2 != 0) {
    std::cerr << "usage: print_poses CALIB.TXT LEFT RIGHT [LEFT RIGHT ...]" << std::endl;
    return 1;
  }
  sdvo::StereoCamera camera = sdvo::readKittiCalibration(argv[1], sdvo::KittiCameras::kGrey);
  const sdvo::FeatureExtractor extractor{sdvo::FeatureExtractorOptions()};
  sdvo::VisualOdometry odometry{sdvo::VisualOdometryOptions()};
  std::int64_t stamp = 0;  // ns
  for (int i = 2; i < argc; i += 2, stamp += 100'000'000) {
    const cv::Mat left = cv::imread(argv[i], cv::IMREAD_GRAYSCALE);
    const cv::Mat right = cv::imread(argv[i + 1], cv::IMREAD_GRAYSCALE);
    camera.width = left.cols, camera.height = left.rows;
    const sdvo::StereoFeatures features = extractor.extract(camera, left, right, stamp);
    const sdvo::OdometryResult result = odometry.update(features);
    std::cout << sdvo::toString(result.state);
    if (result.has_pose) std::cout << " " << result.T_origin_camera.translation().transpose();
    std::cout << " " << result.reason << std::endl;
  }
  return 0;
}
