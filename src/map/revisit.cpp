#include "stereo_descriptor_vo/map/revisit.hpp"

#include <Eigen/Cholesky>

#include "../common/median.hpp"
#include "stereo_descriptor_vo/matching/correspondences.hpp"
#include "stereo_descriptor_vo/motion/motion_refinement.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {
namespace {

/// Median distance in the left image, px, between where correspondences were seen and where a motion puts them.
double medianMiss(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference,
                  const std::vector<Correspondence>& correspondences) {
  std::vector<double> misses;
  misses.reserve(correspondences.size());
  for (const Correspondence& c : correspondences) {
    const Eigen::Vector3d expected = camera.project(T_current_reference * c.point);
    misses.push_back((expected - c.measurement).head<2>().norm());
  }
  return median(misses);
}

}  // namespace

Revisit::Revisit(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion,
                 const PatchAlignmentOptions& alignment)
    : motion_options_(motion), alignment_options_(alignment), views_(matcher.widened(), motion) {}

bool Revisit::recall(const StereoFeatures& features, const RigCalibration& calibration, LocalMap& map) const {
  const OldKeyframe* old = map.revisited();
  if (!old) return false;
  const Eigen::Isometry3d expected = map.newestPose() * old->T_camera_origin.inverse();
  auto [matches, correspondences, motion] = views_.match(old->rows, features, calibration, expected);
  if (!motion.success) return false;

  std::vector<LocalMap::Tie> ties;
  std::vector<Correspondence> aligned;
  for (const int i : motion.inliers) {
    const FeatureMatch& match = matches[i];
    const OldKeyframe::Point& point = old->points[match.reference];
    const auto found = old->reference(match.reference)
                           .findIn(alignment_options_, features, match.current,
                                   motion.T_current_reference * old->T_camera_origin, point.position);
    if (!found) continue;
    const Eigen::Vector3d& then = old->rows.positions[match.reference];
    const Eigen::Vector3d measurement = measurementOf(features, match.current, calibration, found->shift);
    const double scale = then.z() / (motion.T_current_reference * then).z();
    ties.push_back({match.reference, match.current, measurement.head<2>(), found->sigma, scale});
    aligned.push_back({then, measurement});
  }
  if (static_cast<int>(ties.size()) < map.options().lasting_points) return false;
  refineMotion(features.camera, motion_options_, aligned, motion.T_current_reference);
  // If no motion fits to that, the rectification differs over the image, and a link would bend the map.
  constexpr double kSameWorld = 0.3;  // px, median (chosen; up to 0.25 where rectification is exact)
  if (medianMiss(features.camera, motion.T_current_reference, aligned) > kSameWorld) return false;

  // Drift since that key frame is a rigid offset: shift the map first, or the robust kernel rejects the links. Small
  // offsets, within the covariance of the corners, are left to the adjustment: to shift these, too, doubles the error
  // on a desk (0.019 to 0.041 %).
  const Eigen::Isometry3d T_camera_origin = motion.T_current_reference * old->T_camera_origin;
  const Vector6d offset = logSE3(T_camera_origin * map.newestPose().inverse());
  if (offset.dot(motion.covariance.ldlt().solve(offset)) > noiseGate(6)) map.moveTo(T_camera_origin);
  map.recall(*old, ties);
  return true;
}

}  // namespace sdvo
