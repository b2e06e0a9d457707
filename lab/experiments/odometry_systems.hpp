#pragma once

#include <string>
#include <vector>

#include "../../src/motion/motion_estimator.hpp"
#include "reference_sequence.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {

/// The four systems that experiments B and C compare: size by depth or not, one view or both.
struct OdometrySystem {
  std::string name;  ///< "standard", "scale_normalised", "left+right", "stereo"
  bool scale_normalisation;
  DescriptorLayout layout;
};

const std::vector<OdometrySystem>& odometrySystems();

/// Features with grey patches of the left view but no descriptors, one set for each pair.
struct GreyPatches {
  std::vector<StereoFeatures> constant;  ///< every patch of the same size
  std::vector<StereoFeatures> by_depth;  ///< sized as the package's odometry does
};

struct DescribedSequence {
  std::vector<std::vector<StereoFeatures>> of_system;  ///< [system][pair]
  GreyPatches patches;                                 ///< of the same rows
};

/// A sequence described by every system on the same `count` features of each pair.
DescribedSequence describeSequence(const ReferenceSequence& sequence, const ExperimentOptions& options,
                                   double standard_size, int count);

/// 3-D to stereo correspondences of the matches between two pairs.
std::vector<Correspondence> makeCorrespondences(const StereoFeatures& reference, const StereoFeatures& current,
                                                const std::vector<FeatureMatch>& matches);

}  // namespace sdvo
