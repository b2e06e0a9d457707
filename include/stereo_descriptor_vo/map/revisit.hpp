#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/map/local_map.hpp"
#include "stereo_descriptor_vo/matching/patch_alignment.hpp"
#include "stereo_descriptor_vo/matching/view_matcher.hpp"
#include "stereo_descriptor_vo/motion/rig_calibration.hpp"

namespace sdvo {

/// Links the map's newest pair to a remembered key frame of the same place, so that drift since then is taken back.
class Revisit {
 public:
  Revisit(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion,
          const PatchAlignmentOptions& alignment);

  /// Recalls the key frame whose place the newest pair has come back to. Returns whether there was one that enough
  /// aligned points confirm. The map is as before otherwise.
  bool recall(const StereoFeatures& features, const RigCalibration& calibration, LocalMap& map) const;

 private:
  MotionEstimatorOptions motion_options_;
  PatchAlignmentOptions alignment_options_;
  ViewMatcher views_;
};

}  // namespace sdvo
