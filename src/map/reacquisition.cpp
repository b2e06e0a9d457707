#include "reacquisition.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "../common/statistics.hpp"
#include "../motion/correspondence_arrays.hpp"
#include "../motion/motion_refinement.hpp"
#include "../motion/noise.hpp"

namespace sdvo {
namespace {

/// Splits points into `parts` of equal size, at the median along the longer axis each time. Returns the number of parts
/// with a point found.
int partsWithPoints(ExpectedPoint* first, ExpectedPoint* last, int parts) {
  if (parts == 1) return std::any_of(first, last, [](const ExpectedPoint& point) { return point.found; });
  Eigen::Array2d low = first->pixel, high = first->pixel;
  for (const ExpectedPoint* point = first; point < last; ++point) {
    low = low.min(point->pixel.array());
    high = high.max(point->pixel.array());
  }
  const Eigen::Array2d extent = high - low;
  const int axis = extent.y() > extent.x() ? 1 : 0;
  ExpectedPoint* const middle = first + (last - first) * (parts / 2) / parts;
  std::nth_element(first, middle, last,
                   [&](const ExpectedPoint& a, const ExpectedPoint& b) { return a.pixel[axis] < b.pixel[axis]; });
  return partsWithPoints(first, middle, parts / 2) + partsWithPoints(middle, last, parts - parts / 2);
}

/// Whether a pair has a feature around a pixel. A part of the view without any is dark or covered, and is no evidence
/// against the place.
bool isLit(const StereoFeatures& features, const Eigen::Vector3d& pixel) {
  constexpr double kAround = 0.05;  // of the image's width (chosen)
  const double radius = kAround * features.camera.width;
  for (int i = 0; i < features.count(); ++i)
    if (std::abs(features.u[i] - pixel.x()) <= radius && std::abs(features.v[i] - pixel.y()) <= radius) return true;
  return false;
}

/// Which of a map's points are inliers of a view's motion.
std::vector<bool> inliersOf(const ViewMatch& view, const DescribedPoints& map) {
  std::vector<bool> is_inlier(map.positions.size(), false);
  for (const int i : view.motion.inliers) is_inlier[view.matches[i].reference] = true;
  return is_inlier;
}

/// Points of a map that project into a pair, and whether they were matched there.
std::vector<ExpectedPoint> expectedPoints(const DescribedPoints& map, const StereoFeatures& features,
                                          const ViewMatch& view) {
  const std::vector<bool> found = inliersOf(view, map);
  std::vector<ExpectedPoint> points;
  for (std::size_t p = 0; p < map.positions.size(); ++p) {
    const Eigen::Vector3d point = view.motion.T_current_reference * map.positions[p];
    if (point.z() < features.camera.nearestDepth()) continue;
    const Eigen::Vector3d pixel = features.camera.project(point);
    if (features.camera.sees(pixel) && isLit(features, pixel)) points.push_back({pixel.head<2>(), found[p]});
  }
  return points;
}

/// The points that are no inliers of a view's motion.
DescribedPoints withoutInliers(const DescribedPoints& points, const ViewMatch& view) {
  const std::vector<bool> used = inliersOf(view, points);
  DescribedPoints others;
  others.kind = points.kind;
  for (std::size_t p = 0; p < used.size(); ++p) {
    if (used[p]) continue;
    others.positions.push_back(points.positions[p]);
    others.descriptors.push_back(points.descriptors.row(static_cast<int>(p)));
  }
  return others;
}

/// Median reprojection error of a motion in the left image, px.
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

double chanceOfAnotherPlace(std::vector<ExpectedPoint> points) {
  constexpr int kInPart = 3;         // points found: scattered at random they leave exp(-3), 5 % of the parts empty
  constexpr double kRepeated = 0.5;  // probability (chosen) that a part of another place shows a thing of both
  const auto found =
      std::count_if(points.begin(), points.end(), [](const ExpectedPoint& point) { return point.found; });
  const int parts = static_cast<int>(found) / kInPart;
  if (parts == 0) return 1.0;
  return binomialTail(parts, partsWithPoints(points.data(), points.data() + points.size(), parts), kRepeated);
}

/// After consensus, points are predicted to within the threshold, so matches are sought within twice of that.
Reacquisition::Reacquisition(const MotionEstimatorOptions& motion)
    : anywhere_(motion), near_(motion, {std::max(2.0 * motion.inlier_threshold, 1.0)}) {}

std::optional<Reacquisition::Match> Reacquisition::match(const DescribedPoints& seen_again,
                                                         const DescribedPoints& points, const StereoFeatures& features,
                                                         const RigCalibration& calibration) const {
  constexpr double kFalseAlarms = 0.01;  // of other places that share a part of the view (chosen)
  const MotionEstimate motion = anywhere_.match(seen_again, features, calibration).motion;
  if (!motion.success) return std::nullopt;
  ViewMatch view = near_.match(points, features, calibration, motion.T_current_reference);
  if (!view.motion.success) return std::nullopt;
  const double chance = chanceOfAnotherPlace(expectedPoints(points, features, view));
  if (!(chance < kFalseAlarms)) return std::nullopt;
  return Match{std::move(view), chance};
}

std::optional<FoundPlace> Reacquisition::find(const LocalMap& map, const StereoFeatures& features,
                                              const RigCalibration& calibration) const {
  // The search without a gate compares each point with all features. It takes only points that were seen twice: half
  // of all points were seen once, and few of those will be seen again.
  const DescribedPoints points = map.points(1);
  const auto found = match(map.points(2), points, features, calibration);
  if (!found) return std::nullopt;
  FoundPlace place{found->view.motion.T_current_reference, found->chance, std::nullopt};
  // Doors of a corridor, or shelves: if the other points match as well, at another motion, the structure is repeated.
  const DescribedPoints others = withoutInliers(points, found->view);
  const auto second = match(others, others, features, calibration);
  if (second) place.alike = second->view.motion.T_current_reference;
  return place;
}

Revisit::Revisit(const MotionEstimatorOptions& motion)
    : motion_options_(motion), views_(motion, FeatureMatcherOptions::wide()) {}

bool Revisit::recall(const StereoFeatures& features, const RigCalibration& calibration, LocalMap& map) const {
  const OldKeyframe* old = map.revisited();
  if (!old) return false;
  const Eigen::Isometry3d expected = map.newestPose() * old->T_camera_origin.inverse();
  auto [matches, correspondences, motion] = views_.match(old->described, features, calibration, expected);
  if (!motion.success) return false;

  std::vector<LocalMap::Sighting> links;
  std::vector<Correspondence> aligned;
  for (const int i : motion.inliers) {
    const FeatureMatch& match = matches[i];
    const OldKeyframe::Point& point = old->points[match.reference];
    const auto found = point.reference.findIn(map.options().noise, features, match.current,
                                              motion.T_current_reference * old->T_camera_origin, point.position);
    if (!found) continue;
    const Eigen::Vector3d& then = old->described.positions[match.reference];
    const Eigen::Vector3d measurement = measurementOf(features, match.current, calibration, found->shift);
    const double scale = then.z() / (motion.T_current_reference * then).z();
    const Eigen::Vector3d seen(measurement.x(), measurement.y(), features.disparity[match.current]);
    links.push_back({{seen, found->sigma}, match.reference, match.current, true, scale});
    aligned.push_back({then, measurement});
  }
  if (static_cast<int>(links.size()) < map.options().min_shared_points) return false;
  refineMotion(features.camera, motion_options_, aligned, motion.T_current_reference);
  // If no motion fits so well, the rectification errs differently over the image, and a link would bend the map.
  constexpr double kSameWorld = 0.3;  // px, median (chosen; up to 0.25 where rectification is exact)
  if (medianMiss(features.camera, motion.T_current_reference, aligned) > kSameWorld) return false;

  // Drift since that key frame is a rigid offset: shift the map first, or the robust kernel rejects the links. Offsets
  // within the covariance of the corners are left to the adjustment. To shift these as well doubles the error on a
  // rendered desk (0.019 to 0.041 %).
  const Eigen::Isometry3d T_camera_origin = motion.T_current_reference * old->T_camera_origin;
  const Vector6d offset = logSE3(T_camera_origin * map.newestPose().inverse());
  if (mahalanobisSquare(offset, motion.covariance) > noiseGate(6)) map.moveTo(T_camera_origin);
  map.recall(*old, links);
  return true;
}

}  // namespace sdvo
