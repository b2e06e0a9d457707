#include "stereo_descriptor_vo/odometry/reacquisition.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace sdvo {
namespace {

constexpr double kRepeated = 0.5;  // probability that a part of another place shows what stands in both

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

/// Logarithm of how much likelier a part looks like this in the same place, where each point with a feature is found
/// with the probability `usual`, than in another one.
double logRatioOfPart(const ExpectedPoint* first, const ExpectedPoint* last, double usual) {
  if (std::any_of(first, last, [](const ExpectedPoint& point) { return point.found; })) return -std::log(kRepeated);
  const auto missed = std::count_if(first, last, [](const ExpectedPoint& point) { return point.has_feature; });
  const double by_chance = std::pow(1.0 - usual, missed);
  return std::log(by_chance / (kRepeated * by_chance + 1.0 - kRepeated));
}

/// The sum over so many parts, into which points are divided by medians across their longer side.
double logRatio(ExpectedPoint* first, ExpectedPoint* last, int parts, double usual) {
  if (parts == 1) return logRatioOfPart(first, last, usual);
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
  return logRatio(first, middle, parts / 2, usual) + logRatio(middle, last, parts - parts / 2, usual);
}

bool hasFeature(const StereoFeatures& features, const Eigen::Vector3d& pixel, double radius) {
  const auto u = static_cast<float>(pixel.x()), v = static_cast<float>(pixel.y());
  for (int row = 0; row < features.count(); ++row) {
    const float du = features.u[row] - u, dv = features.v[row] - v;
    if (du * du + dv * dv <= radius * radius) return true;
  }
  return false;
}

/// Points of a map that a pair may see, and which of them it shows.
std::vector<ExpectedPoint> expectedPoints(const DescribedPoints& map, const StereoFeatures& features,
                                          const ViewMatch& view, double gate) {
  std::vector<bool> found(map.positions.size(), false);
  for (const int i : view.motion.inliers) found[view.matches[i].reference] = true;
  std::vector<ExpectedPoint> points;
  for (std::size_t p = 0; p < map.positions.size(); ++p) {
    const Eigen::Vector3d point = view.motion.T_current_reference * map.positions[p];
    if (point.z() <= 0.0) continue;
    const Eigen::Vector3d pixel = features.camera.project(point);
    if (features.camera.sees(pixel))
      points.push_back({pixel.head<2>(), found[p] || hasFeature(features, pixel, gate), found[p]});
  }
  return points;
}

}  // namespace

bool showsSamePlace(std::vector<ExpectedPoint> points) {
  constexpr int kInPart = 3;             // points found: if they are spread evenly, 5 % of the parts have none
  constexpr double kFalseAlarms = 0.01;  // of other places, where every part shows something
  const auto found =
      std::count_if(points.begin(), points.end(), [](const ExpectedPoint& point) { return point.found; });
  const auto with_feature =
      std::count_if(points.begin(), points.end(), [](const ExpectedPoint& point) { return point.has_feature; });
  const int parts = static_cast<int>(found) / kInPart;
  if (std::pow(kRepeated, parts) > kFalseAlarms) return false;
  const double usual = static_cast<double>(found) / static_cast<double>(with_feature);
  return logRatio(points.data(), points.data() + points.size(), parts, usual) > 0.0;
}

Reacquisition::Reacquisition(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion)
    : anywhere_(ungated(matcher), motion), gated_(gatedBy(matcher, motion.inlier_threshold)), near_(gated_, motion) {}

std::optional<Eigen::Isometry3d> Reacquisition::find(const LocalMap& map, const StereoFeatures& features,
                                                     const RigCalibration& calibration) const {
  // Without a gate each point costs as much as all features; half of the points were seen once, and few of these again.
  const MotionEstimate motion = anywhere_.match(map.points(2), features, calibration).motion;
  if (!motion.success) return std::nullopt;
  const DescribedPoints points = map.points(1);
  const ViewMatch view = near_.match(points, features, calibration, motion.T_current_reference);
  if (!view.motion.success || !showsSamePlace(expectedPoints(points, features, view, gated_.gate_radius)))
    return std::nullopt;
  return view.motion.T_current_reference;
}

}  // namespace sdvo
