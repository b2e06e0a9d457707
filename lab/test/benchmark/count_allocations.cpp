// Counts the allocations of memory by operator new, pair by pair: lab/run benchmark runs this.
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

/// Blocks of memory since the last reset(): those that were asked for, and those of them that still live.
struct Counter {
  std::int64_t made = 0, kept = 0, first = 0;
  void reset() {
    first += made;
    made = kept = 0;
  }
  void add(const Counter& other) {
    made += other.made;
    kept += other.kept;
  }
} counter;

/// Before each block its number, in as many bytes as keep it aligned.
constexpr std::size_t kHeader = alignof(std::max_align_t);

}  // namespace

void* operator new(std::size_t size) {
  auto* header = static_cast<std::int64_t*>(std::malloc(kHeader + size));
  if (!header) throw std::bad_alloc();
  *header = counter.first + counter.made++;
  ++counter.kept;
  return reinterpret_cast<char*>(header) + kHeader;
}
void operator delete(void* memory) noexcept {
  if (!memory) return;
  void* header = static_cast<char*>(memory) - kHeader;
  counter.kept -= *static_cast<std::int64_t*>(header) >= counter.first;
  std::free(header);
}
void operator delete(void* memory, std::size_t) noexcept {
  operator delete(memory);
}

/// Argument: a folder in KITTI layout. Prints, for image side and motion side, the mean over its second half of the
/// blocks that a pair asks for, and of those that live on in the result or in the map.
int main(int argc, char** argv) {
  if (argc != 2) return 1;
  cv::setNumThreads(1);
  const sdvo::KittiSequence sequence(argv[1]);
  const sdvo::FeatureExtractor extractor{{}};
  sdvo::VisualOdometry odometry{{}};
  Counter image_side, motion_side;
  int pairs = 0;
  for (int i = 0; i < sequence.size(); ++i) {
    const sdvo::ImagePair pair = sequence.load(i);
    const bool counted = 2 * i >= sequence.size();
    counter.reset();
    const sdvo::StereoFeatures features =
        extractor.extract(sequence.camera(), pair.left, pair.right, sequence.stamp(i));
    if (counted) image_side.add(counter);
    counter.reset();
    const sdvo::OdometryResult result = odometry.update(features);
    if (counted) motion_side.add(counter);
    pairs += counted;
  }
  std::cout << std::fixed << std::setprecision(0);
  for (const Counter& side : {image_side, motion_side})
    std::cout << static_cast<double>(side.made) / pairs << " " << static_cast<double>(side.kept) / pairs << " ";
  std::cout << "\n";
  return 0;
}
