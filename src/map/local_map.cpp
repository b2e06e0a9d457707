#include "local_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "../common/statistics.hpp"

namespace sdvo {
namespace {

/// Smallest disparity of a point: below it the distance cannot be measured, and the point is as good as at infinity.
constexpr double kFarthestDisparity = 0.05;  // px

/// Covariance of the motion M = T_from_to between two frames, perturbed as M * exp(xi), from that of the left
/// perturbations of `poses`, without the first: exp(f) M exp(-t) = M exp(Ad(M^-1) f - t) to first order.
Matrix6d motionCovariance(const Window& window, const std::vector<int>& poses, const Eigen::MatrixXd& pose_covariance,
                          int from, int to) {
  if (from == to) return Matrix6d::Zero();
  const auto row_of = [&](int pose) { return 6 * (std::find(poses.begin(), poses.end(), pose) - poses.begin()); };
  const auto t = row_of(to), f = row_of(from);
  Matrix6d covariance = pose_covariance.block<6, 6>(t, t);
  if (from == 0) return covariance;  // held fixed
  const Eigen::Isometry3d T_to_from = window.T_camera_origin[to] * window.T_camera_origin[from].inverse();
  const Matrix6d cross = adjoint(T_to_from) * pose_covariance.block<6, 6>(f, t);
  covariance += carried(T_to_from, pose_covariance.block<6, 6>(f, f)) - cross - cross.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

/// The observation in a frame, or the end. Observations are sorted by their frames.
template <class Observations>
auto observationIn(Observations& observations, int frame_id) {
  const auto here = std::lower_bound(observations.begin(), observations.end(), frame_id,
                                     [](const auto& observation, int id) { return observation.frame_id < id; });
  return here != observations.end() && here->frame_id == frame_id ? here : observations.end();
}

}  // namespace

LocalMap::LocalMap(const LocalMapOptions& options)
    : options_(checked(options)), memory_(options.remembered_keyframes) {}

const LocalMap::Frame& LocalMap::oldest() const {
  return *std::find_if(frames_.begin(), frames_.end(), [](const Frame& frame) { return !frame.is_recalled; });
}

std::pair<Eigen::Isometry3d, double> LocalMap::motionOfWindow() const {
  return {oldest().T_camera_origin * newestPose().inverse(),
          static_cast<double>(newestStamp() - oldest().stamp) * 1e-9};
}

int LocalMap::lastKeyframeId() const {
  for (auto frame = frames_.rbegin(); frame != frames_.rend(); ++frame)
    if (frame->is_keyframe) return frame->id;
  return frames_.front().id;
}

bool LocalMap::continuedBy(const StereoFeatures& features) const {
  return features.camera == camera_ && (features.count() == 0 || features.kind() == kind_);
}

LocalMap::View LocalMap::view(const std::optional<Eigen::Isometry3d>& T_next_newest) const {
  const auto isSeenNext = [&](const Eigen::Vector3d& pixel) {
    if (!T_next_newest) return false;
    const Eigen::Vector3d next = *T_next_newest * camera_.backProject(pixel.x(), pixel.y(), pixel.z());
    return next.z() >= camera_.nearestDepth() && camera_.sees(camera_.project(next));
  };
  View view;
  view.points.kind = kind_;
  view.ids.reserve(points_.size()), view.seen.reserve(points_.size()), view.pixels.reserve(points_.size());
  view.newest.reserve(points_.size());
  const int since = lookedForSince();
  for (std::size_t p = 0; p < points_.size(); ++p) {
    if (!isLookedFor(points_[p], since)) continue;
    auto predicted = predictObservation(camera_, newestPose(), points_[p].position);
    if (!predicted) continue;
    predicted->z() = std::max(predicted->z(), kFarthestDisparity);
    if (!camera_.sees(*predicted) && !isSeenNext(*predicted)) continue;
    view.ids.push_back(static_cast<int>(p));
    view.seen.push_back(points_[p].seen);
    const FrameObservation& last = points_[p].observations.back();
    view.newest.push_back(last.frame_id == newestId() ? last.feature : -1);
    view.pixels.emplace_back(static_cast<float>(predicted->x()), static_cast<float>(predicted->y()),
                             static_cast<float>(predicted->z()));
  }
  view.points.positions.reserve(view.ids.size());
  view.points.descriptors.create(static_cast<int>(view.ids.size()), kind_.bytes, CV_8U);
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    const cv::Point3f& pixel = view.pixels[i];
    view.points.positions.push_back(camera_.backProject(pixel.x, pixel.y, pixel.z));
    const std::vector<std::uint8_t>& descriptor = points_[view.ids[i]].descriptor;
    std::copy(descriptor.begin(), descriptor.end(), view.points.descriptors.ptr(static_cast<int>(i)));
  }
  return view;
}

DescribedPoints LocalMap::points(int sightings) const {
  const double farthest = kFarthestDisparity / (camera_.fx * camera_.baseline);  // 1/m
  const int since = lookedForSince();
  DescribedPoints found;
  found.kind = kind_;
  found.positions.reserve(points_.size());
  found.descriptors.create(static_cast<int>(points_.size()), kind_.bytes, CV_8U);
  for (const Point& point : points_) {
    if (point.seen < sightings || !isLookedFor(point, since)) continue;
    std::copy(point.descriptor.begin(), point.descriptor.end(), found.descriptors.ptr(found.count()));
    const double inverse_depth = std::max(point.position.ray_and_inverse_depth.z(), farthest);
    found.positions.push_back(point.position.scaledPointIn(newestPose()) / inverse_depth);
  }
  found.descriptors = found.descriptors.rowRange(0, found.count());
  return found;
}

void LocalMap::insert(const StereoFeatures& features, int id, const Eigen::Isometry3d& T_camera_origin,
                      const std::vector<Sighting>& sightings, const RigCalibration& calibration) {
  camera_ = features.camera;
  kind_ = features.kind();

  std::vector<bool> recognised(features.u.size(), false);
  for (const Sighting& sighting : sightings) {
    recognised[sighting.feature] = true;
    ++points_[sighting.point].seen;
    points_[sighting.point].observations.push_back({sighting, id, sighting.feature});
  }
  // After the new sightings are added: removeFrame() also removes points that no longer have enough observations.
  if (!frames_.empty() && !frames_.back().is_keyframe) removeFrame(frames_.size() - 1);
  frames_.push_back({id, T_camera_origin, false, false, features.stamp});
  frames_.back().is_keyframe = needsKeyframe();
  // With patches the point is by definition where this corner was detected, so the first sighting hardly errs. Without
  // patches it errs as much as later ones.
  const double sigma = canAlign(features.patch_layout.side) ? NoiseOptions::kReference : options_.noise.corner;
  for (int i = 0; i < features.count(); ++i)
    if (!recognised[i]) startPoint(features, i, id, T_camera_origin, calibration, sigma);
  if (static_cast<int>(frames_.size()) > options_.keyframes + 1) forgetKeyframe();
}

LocalMap::Sighting LocalMap::sight(const StereoFeatures& features, const Eigen::Isometry3d& T_camera_origin, int point,
                                   int feature) const {
  const NoiseOptions& noise = options_.noise;
  const double sigma = canAlign(features.patch_layout.side) ? noise.unconfirmedCorner() : noise.corner;
  Sighting sighting{{{features.u[feature], features.v[feature], features.disparity[feature]}, sigma}, point, feature};
  const Point& seen = points_[point];
  const auto found = seen.reference.findIn(noise, features, feature, T_camera_origin, seen.position);
  if (!found) return sighting;
  sighting.measurement.head<2>() += found->shift;
  sighting.sigma = found->sigma;
  sighting.aligned = true;
  sighting.scale = found->scale;
  return sighting;
}

void LocalMap::renewAppearance(const StereoFeatures& features, const std::vector<Sighting>& sightings) {
  constexpr double kRenewal = 1.2;  // factor on a point's size since its reference patch was taken
  std::vector<const Sighting*> of_feature(features.u.size(), nullptr);
  for (const Sighting& sighting : sightings) of_feature[sighting.feature] = &sighting;
  for (Point& point : points_) {
    const FrameObservation& last = point.observations.back();
    const Sighting* sighting = last.frame_id == newestId() ? of_feature[last.feature] : nullptr;
    if (!sighting) continue;  // not seen, rejected or just started
    takeDescriptor(point, features, last.feature);
    const double change = std::max(sighting->scale, 1.0 / sighting->scale);
    if (sighting->aligned && change > kRenewal)
      point.reference.take(features, last.feature, sighting->measurement.head<2>(), newestPose());
  }
}

void LocalMap::discountNewest() {
  for (Point& point : points_)
    if (point.seen > 1 && point.observations.back().frame_id == newestId()) --point.seen;
}

void LocalMap::takeDescriptor(Point& point, const StereoFeatures& features, int feature) {
  const std::uint8_t* bytes = features.descriptors.ptr(feature);
  point.descriptor.assign(bytes, bytes + features.descriptors.cols);
}

void LocalMap::startPoint(const StereoFeatures& features, int feature, int id, const Eigen::Isometry3d& T_camera_origin,
                          const RigCalibration& calibration, double sigma) {
  const Eigen::Vector3d measurement(features.u[feature], features.v[feature], features.disparity[feature]);
  Point& point = points_.emplace_back();
  point.position.T_origin_anchor = T_camera_origin.inverse();
  point.placeAt(features.camera, measurement, calibration);
  point.reference.take(features, feature, measurement.head<2>(), T_camera_origin);
  point.observations.push_back({{measurement, sigma}, id, feature});
  takeDescriptor(point, features, feature);
}

/// Places a point where a pair saw it: (u_left, v_left, disparity), px.
void LocalMap::Point::placeAt(const StereoCamera& camera, const Eigen::Vector3d& measurement,
                              const RigCalibration& calibration) {
  const double u = measurement.x(), v = measurement.y();
  const double disparity = std::max(measurement.z() - calibration.disparityError(camera, u, v), kFarthestDisparity);
  position.ray_and_inverse_depth = {(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy,
                                    1.0 / camera.depth(disparity)};
}

void LocalMap::moveNewest(const StereoFeatures& before, const StereoFeatures& now, const RigCalibration& calibration) {
  const auto measured = [](const StereoFeatures& features, int i) {
    return Eigen::Vector3d(features.u[i], features.v[i], features.disparity[i]);
  };
  for (Point& point : points_) {
    FrameObservation& last = point.observations.back();
    if (last.frame_id != newestId()) continue;
    last.measurement += measured(now, last.feature) - measured(before, last.feature);
    if (point.observations.size() == 1) point.placeAt(camera_, last.measurement, calibration);
  }
}

bool LocalMap::needsKeyframe() const {
  const int id = newestId(), keyframe = lastKeyframeId();
  if (id == keyframe) return true;  // the first one
  std::vector<double> parallax;
  parallax.reserve(points_.size());
  int seen = 0;
  for (const Point& point : points_) {
    if (point.observations.back().frame_id != id) continue;
    ++seen;
    for (const FrameObservation& observation : point.observations)
      if (observation.frame_id == keyframe)
        parallax.push_back((observation.measurement - point.observations.back().measurement).head<2>().norm());
  }
  if (static_cast<double>(parallax.size()) < options_.keyframe_overlap * seen || parallax.empty()) return true;
  return median(parallax) > options_.keyframe_parallax;
}

/// Remembers a key frame, once, when it is none of the `keyframes` newest ones any more. It may stay in the map.
void LocalMap::rememberKeyframe(const Frame& frame) {
  if (frame.id <= last_remembered_) return;
  last_remembered_ = frame.id;
  if (options_.remembered_keyframes == 0 || frame.is_recalled) return;
  OldKeyframe old = keyframe(frame);
  // With fewer points it could not be recalled.
  if (old.described.count() >= options_.min_shared_points) memory_.remember(camera_, std::move(old));
}

/// Removes key frames that are older than the `keyframes` newest ones: the oldest that shares too few points with the
/// newest pair, and while they are too many, the one with the least parallax to the frame before.
void LocalMap::forgetKeyframe() {
  // Number of frames before these newest ones and the newest pair.
  const auto older = [&] { return frames_.size() - 1 - static_cast<std::size_t>(options_.keyframes); };
  rememberKeyframe(frames_[older() - 1]);
  const std::vector<int> shared = sharedPoints();
  const auto too_few = std::find_if(shared.begin(), shared.begin() + static_cast<std::ptrdiff_t>(older()),
                                    [&](int points) { return points < options_.min_shared_points; });
  const std::size_t unshared = static_cast<std::size_t>(too_few - shared.begin());
  if (unshared < older()) removeFrame(unshared);
  while (static_cast<int>(older()) > options_.keyframes) {
    const std::vector<double> parallax = parallaxToPredecessors(older());
    removeFrame(static_cast<std::size_t>(std::min_element(parallax.begin(), parallax.end()) - parallax.begin()));
  }
}

/// A copy of a frame with those of its points that other frames have seen as well.
OldKeyframe LocalMap::keyframe(const Frame& frame) const {
  OldKeyframe old{frame.id, frame.T_camera_origin, {}, {}};
  old.described.kind = kind_;
  for (const Point& point : points_) {
    const auto seen = observationIn(point.observations, frame.id);
    if (point.observations.size() < 2 || seen == point.observations.end()) continue;
    const auto predicted = predictObservation(camera_, frame.T_camera_origin, point.position);
    if (!predicted) continue;
    old.described.positions.push_back(
        camera_.backProject(predicted->x(), predicted->y(), std::max(predicted->z(), kFarthestDisparity)));
    old.described.descriptors.push_back(cv::Mat(point.descriptor).reshape(1, 1));
    old.points.push_back({point.position, *seen, point.reference});
  }
  return old;
}

const OldKeyframe* LocalMap::revisited() const {
  const auto is_recalled = [](const Frame& frame) { return frame.is_recalled; };
  if (std::any_of(frames_.begin(), frames_.end(), is_recalled)) return nullptr;
  const OldKeyframe* nearest = memory_.nearest(camera_, newestPose(), options_.min_shared_points);
  const auto is_here = [&](const Frame& frame) { return frame.id == nearest->id; };
  return nearest && std::none_of(frames_.begin(), frames_.end(), is_here) ? nearest : nullptr;
}

void LocalMap::recall(const OldKeyframe& old, const std::vector<Sighting>& links) {
  const auto later =
      std::find_if(frames_.begin(), frames_.end(), [&](const Frame& frame) { return frame.id > old.id; });
  frames_.insert(later, {old.id, old.T_camera_origin, true, true});
  std::unordered_map<int, Point*> of_feature;
  for (Point& point : points_)
    if (point.observations.back().frame_id == newestId()) of_feature[point.observations.back().feature] = &point;
  for (const Sighting& link : links) {
    auto& observations = of_feature.at(link.feature)->observations;
    const OldKeyframe::Point& point = old.points[link.point];
    // The old key frame's reference and the map point's may be of spots a little apart: the measurement is shifted.
    const Eigen::Vector2d apart = (link.measurement - observations.back().measurement).head<2>();
    Eigen::Vector3d measurement = point.observation.measurement;
    measurement.head<2>() -= apart / link.scale;
    const auto place = std::find_if(observations.begin(), observations.end(),
                                    [&](const FrameObservation& observation) { return observation.frame_id > old.id; });
    observations.insert(place, {{measurement, std::hypot(point.observation.sigma, link.sigma)}, old.id, -1});
  }
}

void LocalMap::moveTo(const Eigen::Isometry3d& T_newest_origin) {
  const Eigen::Isometry3d T_old_new = newestPose().inverse() * T_newest_origin;
  for (Frame& frame : frames_) frame.T_camera_origin = frame.T_camera_origin * T_old_new;
  for (Point& point : points_) {
    point.position.T_origin_anchor = T_old_new.inverse() * point.position.T_origin_anchor;
    point.reference.T_camera_origin = point.reference.T_camera_origin * T_old_new;
  }
}

/// For each frame, the number of points that it shares with the newest pair.
std::vector<int> LocalMap::sharedPoints() const {
  std::vector<int> shared(frames_.size(), 0);
  for (const Point& point : points_) {
    if (point.observations.back().frame_id != newestId()) continue;
    std::size_t f = 0;
    for (const FrameObservation& observation : point.observations) {
      while (frames_[f].id < observation.frame_id) ++f;
      ++shared[f];
    }
  }
  return shared;
}

/// For each of the first frames the median distance in px by which points moved since the frame before; infinite for
/// the very first, and where none are shared.
std::vector<double> LocalMap::parallaxToPredecessors(std::size_t frames) const {
  std::vector<std::vector<double>> distances(frames);
  for (const Point& point : points_) {
    std::size_t f = 0;
    for (std::size_t k = 1; k < point.observations.size(); ++k) {
      const FrameObservation &before = point.observations[k - 1], &here = point.observations[k];
      while (f < frames && frames_[f].id < here.frame_id) ++f;
      if (f == frames) break;
      if (frames_[f - 1].id == before.frame_id)
        distances[f].push_back((here.measurement - before.measurement).head<2>().norm());
    }
  }
  std::vector<double> parallax(frames, std::numeric_limits<double>::infinity());
  for (std::size_t f = 0; f < frames; ++f)
    if (!distances[f].empty()) parallax[f] = median(distances[f]);
  return parallax;
}

/// Points with one observation are looked for if it is of this frame (id) or a later one.
int LocalMap::lookedForSince() const {
  constexpr std::size_t kMissed = 4;  // frames of the map that may miss it
  return frames_[frames_.size() - std::min(frames_.size(), kMissed)].id;
}

/// A point that was seen once and then missed is most often a wrong stereo match.
bool LocalMap::isLookedFor(const Point& point, int since) {
  const std::size_t sightings = point.observations.size();
  return sightings >= 2 || (sightings == 1 && point.observations.back().frame_id >= since);
}

void LocalMap::removeFrame(std::size_t index) {
  const int id = frames_[index].id;
  frames_.erase(frames_.begin() + static_cast<std::ptrdiff_t>(index));
  for (Point& point : points_) {
    const auto here = observationIn(point.observations, id);
    if (here != point.observations.end()) point.observations.erase(here);
  }
  const auto is_forgotten = [since = lookedForSince()](const Point& point) { return !isLookedFor(point, since); };
  points_.erase(std::remove_if(points_.begin(), points_.end(), is_forgotten), points_.end());
}

LocalMap::Problem LocalMap::problem() const {
  Problem problem;
  Window& window = problem.window;
  window.camera = camera_;
  for (const Frame& frame : frames_) window.T_camera_origin.push_back(frame.T_camera_origin);
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const Point& point = points_[p];
    if (point.observations.size() < 2) continue;
    std::size_t frame = 0;
    for (const FrameObservation& observation : point.observations) {
      while (frames_[frame].id < observation.frame_id) ++frame;
      window.observations.push_back({observation, static_cast<int>(problem.points.size()), static_cast<int>(frame)});
    }
    if (point.observations.back().frame_id == newestId())
      problem.newest.push_back(static_cast<int>(window.observations.size()) - 1);
    window.points.push_back(point.position);
    problem.points.push_back(static_cast<int>(p));
  }
  return problem;
}

std::vector<Eigen::Vector3d> LocalMap::positions() const {
  const double farthest = kFarthestDisparity / (camera_.fx * camera_.baseline);  // 1/m, where it was seen first
  std::vector<Eigen::Vector3d> positions;
  for (const Point& point : points_) {
    const double inverse_depth = point.position.ray_and_inverse_depth.z();
    if (inverse_depth > farthest)
      positions.push_back(point.position.scaledPointIn(Eigen::Isometry3d::Identity()) / inverse_depth);
  }
  return positions;
}

LocalMap::Adjustment LocalMap::adjust(WindowOptimizer& optimizer, const CalibrationBelief& prior,
                                      RigCalibration& calibration, const std::optional<Floor>& floor) {
  Adjustment adjustment;
  const int newest = static_cast<int>(frames_.size()) - 1;
  if (newest == 0) return adjustment;
  Problem problem = this->problem();
  Window& window = problem.window;
  window.calibration = calibration;
  window.calibration_prior = prior;
  window.floor = floor;

  const int keyframe = newest - 1;  // the last one; pose 0 is held fixed
  std::vector<int> poses{newest};   // whose covariances are needed below
  if (keyframe > 0) poses.push_back(keyframe);
  const WindowSolution& solution = optimizer.optimize(window, poses);
  if (!solution.success) return adjustment;
  adjustment.success = true;
  adjustment.calibration_information = solution.calibration_information;
  adjustment.common_disparity_square = solution.common_disparity_square;
  const auto covarianceOfMotion = [&](int from, int to) {
    return motionCovariance(window, poses, solution.pose_covariance, from, to);
  };
  adjustment.since_keyframe = covarianceOfMotion(keyframe, newest);
  const Eigen::Isometry3d T_newest_keyframe =
      window.T_camera_origin[newest] * window.T_camera_origin[keyframe].inverse();
  const Matrix6d keyframe_in_newest = carried(T_newest_keyframe, covarianceOfMotion(0, keyframe));
  adjustment.growth = positivePart(covarianceOfMotion(0, newest) - keyframe_in_newest);
  // Right perturbation of the motion by left ones of its two poses: as in motionCovariance().
  adjustment.by_calibration = -solution.pose_by_calibration.topRows<6>();
  if (keyframe > 0)
    adjustment.by_calibration += adjoint(T_newest_keyframe) * solution.pose_by_calibration.bottomRows<6>();
  calibration = window.calibration;
  for (std::size_t f = 0; f < frames_.size(); ++f)
    frames_[f].T_camera_origin = orthonormalised(window.T_camera_origin[f]);
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    points_[problem.points[i]].position.ray_and_inverse_depth = window.points[i].ray_and_inverse_depth;
  std::vector<double> newest_squares;
  for (const int i : problem.newest) newest_squares.push_back(solution.squares[i]);
  adjustment.newest_measured = static_cast<int>(newest_squares.size());
  adjustment.newest_square = median(newest_squares);
  rejectOutliers(problem, solution.squares, adjustment);
  return adjustment;
}

double LocalMap::varianceOfMotion() const {
  const double newest = frames_.back().variance;
  return frames_.size() < 2 ? newest : 0.5 * (newest + frames_[frames_.size() - 2].variance);
}

void LocalMap::rejectOutliers(const Problem& problem, const std::vector<double>& squares, Adjustment& adjustment) {
  // Two degrees of freedom, those of the position in the image: disparities share an error, so a single one has little
  // weight. The factor is because the point's position errs as much as its observation's.
  const double gate = 2.0 * noiseGate(2);
  for (const int i : problem.newest) {
    // The sigma of a corner that no patch confirms allows for a neighbour's corner. The gate does not: the point's own
    // corner lies within a corner's noise.
    const double wider = std::max(problem.window.observations[i].sigma / options_.noise.corner, 1.0);
    if (wider * wider * squares[i] <= gate) continue;
    Point& point = points_[problem.points[problem.window.observations[i].point]];
    adjustment.rejected.push_back(point.observations.back().feature);
    --point.seen;
    point.observations.pop_back();
  }
}

}  // namespace sdvo
