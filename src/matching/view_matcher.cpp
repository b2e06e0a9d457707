#include "stereo_descriptor_vo/matching/view_matcher.hpp"

#include "stereo_descriptor_vo/matching/correspondences.hpp"

namespace sdvo {

ViewMatch ViewMatcher::match(const DescribedPoints& reference, const StereoFeatures& features,
                             const RigCalibration& calibration,
                             const std::optional<Eigen::Isometry3d>& expected) const {
  ViewMatch view;
  view.matches = matcher_.match(reference, features, expected);
  view.correspondences = correspond(reference, features, view.matches, calibration);
  view.motion = estimator_.estimate(features.camera, view.correspondences, expected);
  return view;
}

}  // namespace sdvo
