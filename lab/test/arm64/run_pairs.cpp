// The first pairs of a folder in KITTI layout in one thread, with vectors or in plain C++: lab/test/arm64/run counts
// what it executes.
#include <cstdlib>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <string>

#include "../../../src/common/kernel.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

/// Arguments: the folder, the number of pairs, `plain` or `vectors`, `decode` (images are read and nothing else) or
/// `run`.
int main(int argc, char** argv) {
  if (argc != 5) return 1;
  cv::setNumThreads(1);
  sdvo::allowVectorKernels(std::string(argv[3]) == "vectors");
  const bool runs = std::string(argv[4]) == "run";
  const sdvo::KittiSequence sequence(argv[1]);
  const sdvo::FeatureExtractor extractor{{}};
  sdvo::VisualOdometry odometry{{}};
  int inliers = 0;
  for (int i = 0; i < std::atoi(argv[2]); ++i) {
    const sdvo::ImagePair pair = sequence.load(i);
    if (!runs) continue;
    inliers += odometry.update(extractor.extract(sequence.camera(), pair.left, pair.right, sequence.stamp(i))).inliers;
  }
  std::cout << inliers << " inliers\n";
  return 0;
}
