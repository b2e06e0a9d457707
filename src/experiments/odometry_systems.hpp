#pragma once

#include <string>
#include <vector>

#include "reference_sequence.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/motion_estimator.hpp"

namespace sdvo {

/// The four systems that experiments B and C compare: size by depth or not, one view or both.
struct OdometrySystem {
  std::string name;  ///< "standard", "scale_normalised", "left+right", "stereo"
  bool scale_normalisation;
  DescriptorLayout layout;
};

const std::vector<OdometrySystem>& odometrySystems();

/// A sequence described by every system on the same `count` features of each pair: element [system][pair].
std::vector<std::vector<StereoFeatures>> describeSequence(const ReferenceSequence& sequence,
                                                          const PipelineOptions& options, double standard_size,
                                                          int count);

/// 3-D to stereo correspondences of the matches between two pairs, by descriptors alone.
std::vector<Correspondence> makeCorrespondences(const StereoFeatures& reference, const StereoFeatures& current);

}  // namespace sdvo
