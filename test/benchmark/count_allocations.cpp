// Counts the allocations of memory by operator new, pair by pair: scripts/benchmark runs this.
#include <cstdint>
#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <new>
#include <opencv2/core/utility.hpp>

#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace {

std::int64_t allocations = 0;

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

/// Argument: a folder in KITTI layout. Prints the mean of image side and motion side over its second half.
int main(int argc, char** argv) {
  if (argc != 2) return 1;
  cv::setNumThreads(1);
  const sdvo::KittiSequence sequence(argv[1]);
  const sdvo::FeatureExtractor extractor{{}};
  sdvo::VisualOdometry odometry{{}};
  double image_side = 0.0, motion_side = 0.0;
  int counted = 0;
  for (int i = 0; i < sequence.size(); ++i) {
    const sdvo::ImagePair pair = sequence.load(i);
    const std::int64_t before = allocations;
    const sdvo::StereoFeatures features =
        extractor.extract(sequence.camera(), pair.left, pair.right, sequence.stamp(i));
    const std::int64_t between = allocations;
    const sdvo::OdometryResult result = odometry.update(features);
    if (2 * i < sequence.size()) continue;
    image_side += static_cast<double>(between - before);
    motion_side += static_cast<double>(allocations - between);
    ++counted;
  }
  std::cout << std::fixed << std::setprecision(0) << image_side / counted << " " << motion_side / counted << "\n";
  return 0;
}
