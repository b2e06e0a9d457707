#include "stereo_descriptor_vo/matching/correspondences.hpp"

namespace sdvo {

Eigen::Vector3d measurementOf(const StereoFeatures& features, int row, const RigCalibration& calibration,
                              const Eigen::Vector2d& shift) {
  const double u = features.u[row] + shift.x(), v = features.v[row] + shift.y();
  return {u, v, u - (features.disparity[row] - calibration.disparityError(features.camera, u))};
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

}  // namespace sdvo
