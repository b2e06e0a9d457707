#include "stereo_descriptor_vo/odometry/rival_motion.hpp"

#include <algorithm>
#include <cstddef>

namespace sdvo {

MotionEstimate estimateAmong(const MotionEstimator& estimator, const StereoCamera& camera,
                             const std::vector<Correspondence>& correspondences, const std::vector<int>& subset) {
  std::vector<Correspondence> some;
  some.reserve(subset.size());
  for (const int i : subset) some.push_back(correspondences[i]);
  MotionEstimate estimate = estimator.estimate(camera, some);
  for (int& i : estimate.inliers) i = subset[i];
  return estimate;
}

bool agree(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
           const std::vector<int>& points, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double within) {
  const auto same = std::count_if(points.begin(), points.end(), [&](int i) {
    const Eigen::Vector3d in_a = a * correspondences[i].point, in_b = b * correspondences[i].point;
    if (in_a.z() <= 0.0 || in_b.z() <= 0.0) return false;
    return (camera.project(in_a) - camera.project(in_b)).norm() < within;
  });
  return 2 * static_cast<std::size_t>(same) > points.size();
}

}  // namespace sdvo
