#pragma once

#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "../../src/front_end/depth_scale.hpp"
#include "../../src/front_end/feature_detector.hpp"
#include "../../src/front_end/patch_cutter.hpp"
#include "../../src/front_end/stereo_descriptor.hpp"
#include "../../src/front_end/stereo_matcher.hpp"
#include "experiment_setup.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

namespace sdvo {

/// A corner with its place in the right view; no size yet.
struct StereoCorner {
  Corner corner;
  StereoMatch match;  ///< left_index is not used
};

/// The stereo corners of one pair, to be described at whatever sizes an experiment compares.
struct KeypointSet {
  std::int64_t stamp = 0;  ///< ns
  StereoCamera camera;
  ImagePair images;
  std::vector<StereoCorner> corners;
};

/// Detects and stereo matches frame i of a sequence.
KeypointSet findKeypoints(const KittiSequence& sequence, int i, const ExperimentOptions& options);

/// Distance in px from its centre within which a key point of a size in px needs the image.
using Reach = std::function<double(double size)>;

/// Indices of the `count` strongest corners, spread over buckets, among those whose neighbourhood lies inside both
/// views at the size that every one of `curves` gives. Hence all curves describe exactly the same features. Fewer when
/// there are no more; indices of a smaller count are a subset of those of a larger one.
std::vector<int> selectKeypoints(const KeypointSet& set, const std::vector<DepthScale>& curves, const Reach& reach,
                                 int bucket_size, int count);

/// Describes the chosen corners with sizes by each of `curves`, one row each in the order of `chosen`. All sizes are
/// described in one call, so that a pyramid is made once. Throws std::runtime_error when the descriptor leaves one out.
std::vector<StereoFeatures> describeKeypoints(const KeypointSet& set, const std::vector<int>& chosen,
                                              const std::vector<DepthScale>& curves,
                                              const StereoDescriptor& descriptor);

/// The chosen corners with grey patches of the left view instead of descriptors, sized by `curve`.
StereoFeatures cutPatches(const KeypointSet& set, const std::vector<int>& chosen, const DepthScale& curve,
                          const PatchLayout& layout);

/// The given rows of a feature set; the left layout of a set of both views keeps the left halves.
StereoFeatures selectRows(const StereoFeatures& features, const std::vector<int>& rows, DescriptorLayout layout);

}  // namespace sdvo
