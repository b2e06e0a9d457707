#include "stereo_descriptor_vo/map/reacquisition.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "../common/binomial_tail.hpp"
#include "stereo_descriptor_vo/motion/correspondence_arrays.hpp"

namespace sdvo {
namespace {

FeatureMatcherOptions ungated(FeatureMatcherOptions options) {
  options.gating = false;  // nothing is known of where the camera is
  return options;
}

/// Consensus leaves the points within the threshold; their matches lie within twice of that.
FeatureMatcherOptions gatedBy(FeatureMatcherOptions options, double threshold) {
  options.gating = true;
  options.gate_radius = std::max(2.0 * threshold, 1.0);
  return options;
}

/// Divides points into so many parts by medians across their longer side. The number of parts with a point found.
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

/// Whether a pair has a feature around a pixel. A part of the view without any is dark or covered: it tells nothing.
bool isLit(const StereoFeatures& features, const Eigen::Vector3d& pixel) {
  constexpr double kAround = 0.05;  // of the image's width (chosen)
  const double radius = kAround * features.camera.width;
  for (int row = 0; row < features.count(); ++row)
    if (std::abs(features.u[row] - pixel.x()) <= radius && std::abs(features.v[row] - pixel.y()) <= radius) return true;
  return false;
}

/// Points of a map that a pair may see, and which of them it shows.
std::vector<ExpectedPoint> expectedPoints(const DescribedPoints& map, const StereoFeatures& features,
                                          const ViewMatch& view) {
  std::vector<bool> found(map.positions.size(), false);
  for (const int i : view.motion.inliers) found[view.matches[i].reference] = true;
  std::vector<ExpectedPoint> points;
  for (std::size_t p = 0; p < map.positions.size(); ++p) {
    const Eigen::Vector3d point = view.motion.T_current_reference * map.positions[p];
    if (point.z() < kNearestDepth) continue;
    const Eigen::Vector3d pixel = features.camera.project(point);
    if (features.camera.sees(pixel) && isLit(features, pixel)) points.push_back({pixel.head<2>(), found[p]});
  }
  return points;
}

}  // namespace

bool showsSamePlace(std::vector<ExpectedPoint> points) {
  constexpr int kInPart = 3;             // points found: if they are spread evenly, 5 % of the parts have none
  constexpr double kRepeated = 0.5;      // probability that a part of another place shows what stands in both
  constexpr double kFalseAlarms = 0.01;  // of such places
  const auto found =
      std::count_if(points.begin(), points.end(), [](const ExpectedPoint& point) { return point.found; });
  const int parts = static_cast<int>(found) / kInPart;
  if (parts == 0) return false;
  const int agreeing = partsWithPoints(points.data(), points.data() + points.size(), parts);
  return binomialTail(parts, agreeing, kRepeated) < kFalseAlarms;
}

Reacquisition::Reacquisition(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion)
    : anywhere_(ungated(matcher), motion), near_(gatedBy(matcher, motion.inlier_threshold), motion) {}

std::optional<Eigen::Isometry3d> Reacquisition::find(const LocalMap& map, const StereoFeatures& features,
                                                     const RigCalibration& calibration) const {
  // Without a gate each point costs as much as all features; half of the points were seen once, and few of these again.
  const MotionEstimate motion = anywhere_.match(map.points(2), features, calibration).motion;
  if (!motion.success) return std::nullopt;
  const DescribedPoints points = map.points(1);
  const ViewMatch view = near_.match(points, features, calibration, motion.T_current_reference);
  if (!view.motion.success || !showsSamePlace(expectedPoints(points, features, view))) return std::nullopt;
  return view.motion.T_current_reference;
}

}  // namespace sdvo
