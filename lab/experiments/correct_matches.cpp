#include "correct_matches.hpp"

#include <cmath>
#include <optional>

#include "../../src/motion/correspondence_arrays.hpp"

namespace sdvo {

std::vector<FeatureMatch> matchByDescriptor(const StereoFeatures& reference, const StereoFeatures& current) {
  FeatureMatcherOptions options;
  options.max_distance = 1.0;
  return FeatureMatcher(options).match(reference, current, std::nullopt);
}

int countCorrect(const StereoFeatures& reference, const StereoFeatures& current,
                 const std::vector<FeatureMatch>& matches, const Eigen::Isometry3d& T_current_reference,
                 double tolerance) {
  int correct = 0;
  for (const FeatureMatch& match : matches) {
    const Eigen::Vector3d point = T_current_reference * reference.point(match.reference);
    if (point.z() < current.camera.nearestDepth()) continue;
    const Eigen::Vector3d predicted = current.camera.project(point);
    const Eigen::Vector3d measured = current.measurement(match.current);
    if (std::hypot(predicted.x() - measured.x(), predicted.y() - measured.y()) <= tolerance) ++correct;
  }
  return correct;
}

}  // namespace sdvo
