#include "stereo_descriptor_vo/places/place_verifier.hpp"

#include <vector>

#include "stereo_descriptor_vo/belief/motion_hypotheses.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {
namespace {

FeatureMatcherOptions matcherOptions(const PlaceVerifierOptions& options) {
  FeatureMatcherOptions matcher;
  matcher.gating = false;  // nothing is known of where the place would be seen from
  matcher.max_distance = options.max_distance;
  return matcher;
}

MotionEstimatorOptions estimatorOptions(const PlaceVerifierOptions& options) {
  MotionEstimatorOptions estimator;
  estimator.inlier_threshold = options.inlier_threshold;
  // Enough for the smallest share of inliers that is accepted; what is another place takes all of them.
  estimator.max_iterations = 150;
  return estimator;
}

}  // namespace

PlaceVerifier::PlaceVerifier(const PlaceVerifierOptions& options)
    : options_(checked(options)), views_(matcherOptions(options), estimatorOptions(options)) {}

PlaceMatch PlaceVerifier::verify(const StereoFeatures& place, const StereoFeatures& current) const {
  const auto [matches, correspondences, motion] = views_.match(place, current, RigCalibration());
  PlaceMatch match;
  match.matches = static_cast<int>(matches.size());
  if (match.matches < options_.min_inliers) {
    match.reason = "only " + std::to_string(match.matches) + " matches";
    return match;
  }
  if (!motion.success) {
    match.reason = motion.reason;
    return match;
  }
  std::vector<int> indices;
  for (const int i : motion.inliers) indices.push_back(matches[i].current);
  match.inliers = static_cast<int>(indices.size());
  match.coverage = coverage(current, indices);
  match.rms = motion.rms;
  // exp(xi) T_camera_place inverted is T_place_camera exp(-xi): the covariance is the same, but for the noise of the
  // place's own view, which the motion's does not count.
  match.T_place_camera = motion.T_current_reference.inverse();
  match.covariance = 2.0 * motion.covariance;

  const std::string inliers = std::to_string(match.inliers) + " of " + std::to_string(match.matches) + " matches";
  if (match.inliers < options_.min_inliers || match.inliers < options_.min_inlier_ratio * match.matches)
    match.reason = "only " + inliers + " agree";
  else if (match.coverage < options_.min_coverage)
    match.reason = inliers + " agree, but only in a small part of the image";
  else if (match.rms > options_.max_rms)
    match.reason = inliers + " agree, but with residuals above verifier/max_rms";
  match.same = match.reason.empty();
  return match;
}

}  // namespace sdvo
