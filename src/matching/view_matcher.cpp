#include "view_matcher.hpp"

namespace sdvo {

Eigen::Vector3d measurementOf(const StereoFeatures& features, int feature, const RigCalibration& calibration,
                              const Eigen::Vector2d& shift) {
  const double u = features.u[feature] + shift.x(), v = features.v[feature] + shift.y();
  return {u, v, u - (features.disparity[feature] - calibration.disparityError(features.camera, u, v))};
}

std::vector<Correspondence> correspond(const DescribedPoints& reference, const StereoFeatures& features,
                                       const std::vector<FeatureMatch>& matches, const RigCalibration& calibration) {
  std::vector<Correspondence> correspondences;
  correspondences.reserve(matches.size());
  for (const FeatureMatch& match : matches)
    correspondences.push_back(
        {reference.positions[match.reference], measurementOf(features, match.current, calibration)});
  return correspondences;
}

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
