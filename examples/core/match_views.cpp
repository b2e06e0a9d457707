#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <stereo_descriptor_vo/data/kitti_dataset.hpp>
#include <stereo_descriptor_vo/front_end/feature_extractor.hpp>
#include <stereo_descriptor_vo/matching/feature_matcher.hpp>

/// The stereo descriptors alone: matches of two pairs of rectified images. Each line has the point in the first left
/// camera, m, its pixel in the second left image, and the distance of the descriptors.
int main(int argc, char** argv) {
  if (argc != 6) {
    std::cerr << "usage: match_views CALIB.TXT LEFT RIGHT OTHER_LEFT OTHER_RIGHT" << std::endl;
    return 1;
  }
  sdvo::StereoCamera camera = sdvo::readKittiCalibration(argv[1], sdvo::KittiCameras::kGrey);
  const sdvo::FeatureExtractor extractor{sdvo::FeatureExtractorOptions()};
  const auto describe = [&](int i) {
    const cv::Mat left = cv::imread(argv[i], cv::IMREAD_GRAYSCALE);
    const cv::Mat right = cv::imread(argv[i + 1], cv::IMREAD_GRAYSCALE);
    camera.width = left.cols, camera.height = left.rows;
    return extractor.extract(camera, left, right, i);
  };
  const sdvo::DescribedPoints first(describe(2));
  const sdvo::StereoFeatures second = describe(4);
  const sdvo::FeatureMatcher matcher{sdvo::FeatureMatcherOptions()};
  for (const sdvo::FeatureMatch& match : matcher.match(first, second, std::nullopt))
    std::cout << first.positions[match.reference].transpose() << " -> " << second.u[match.current] << " "
              << second.v[match.current] << " (" << match.distance << ")" << std::endl;
  return 0;
}
