#include <algorithm>
#include <iostream>
#include <opencv2/imgproc.hpp>
#include <stereo_descriptor_vo/front_end/feature_extractor.hpp>

/// The core in another package: describes a made-up stereo pair, a flat picture 20 px apart in both views.
int main() {
  constexpr int kDisparity = 20;  // px
  const cv::Size size(640, 480);
  cv::Mat scene(size.height, size.width + kDisparity, CV_8U);
  cv::RNG(1).fill(scene, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(scene, scene, cv::Size(), 3.0);
  cv::normalize(scene, scene, 0, 255, cv::NORM_MINMAX);
  const cv::Mat left = scene(cv::Rect({0, 0}, size)).clone(), right = scene(cv::Rect({kDisparity, 0}, size)).clone();

  sdvo::StereoCamera camera;
  camera.fx = camera.fy = 500.0;  // px
  camera.cx = 320.0;
  camera.cy = 240.0;
  camera.baseline = 0.1;  // m
  camera.width = size.width;
  camera.height = size.height;

  const sdvo::FeatureExtractor extractor{sdvo::FeatureExtractorOptions()};
  const sdvo::StereoFeatures features = extractor.extract(camera, left, right, 0);
  if (features.count() == 0) {
    std::cerr << "error: no features: " << features.report.status << std::endl;
    return 1;
  }
  std::vector<double> depths;
  for (int i = 0; i < features.count(); ++i) depths.push_back(features.point(i).z());
  std::nth_element(depths.begin(), depths.begin() + features.count() / 2, depths.end());
  std::cout << features.count() << " features of " << features.descriptors.cols << " bytes, median depth "
            << depths[depths.size() / 2] << " m (true: " << camera.fx * camera.baseline / kDisparity << " m)"
            << std::endl;
  return 0;
}
