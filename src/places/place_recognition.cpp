#include "stereo_descriptor_vo/places/place_recognition.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <utility>

#include "../common/stopwatch.hpp"
#include "../common/text.hpp"
#include "../rig/rolling_shutter.hpp"
#include "loop_agreement.hpp"
#include "place_index.hpp"
#include "place_verifier.hpp"

namespace sdvo {
namespace {

constexpr int kMostNumber = std::numeric_limits<int>::max() / 2;  ///< of places and segments that are loaded
constexpr int kMostApart = 1'000'000;                             ///< between ids of places: the largest max_places

/// Covariance of an unknown motion: so wide that it constrains nothing.
Matrix6d unknown() {
  return isotropic(1000.0 * 1000.0, 10.0 * 10.0);
}

/// The features of a rolling shutter as a global one sees them at the stamp, without those that it does not see.
StereoFeatures atStamp(const StereoFeatures& taken, const CameraMotion& motion) {
  const StereoFeatures global = RollingShutter::asGlobal({taken, motion.readout, motion.velocity});
  std::vector<int> seen;
  for (int i = 0; i < global.count(); ++i)
    if (global.camera.sees({global.u[i], global.v[i], global.u[i] - global.disparity[i]})) seen.push_back(i);
  return global.select(seen);
}

}  // namespace

struct PlaceRecognition::Tools {
  PlaceIndex index;
  PlaceVerifier verifier;
  LoopAgreement agreement;
};

PlaceRecognition::PlaceRecognition(const PlaceRecognitionOptions& options)
    : options_(checked(options)), tools_(std::make_unique<Tools>()) {}
PlaceRecognition::PlaceRecognition(PlaceRecognition&&) noexcept = default;
PlaceRecognition::~PlaceRecognition() = default;

std::optional<PlaceReport> PlaceRecognition::observe(const StereoFeatures& features, const CameraMotion& motion) {
  features.check();
  if (!places_.empty() && features.count() > 0 && features.kind() != places_.begin()->second.features.kind())
    throw std::invalid_argument("the places are described by " + toString(places_.begin()->second.features.kind()) +
                                ", not by " + toString(features.kind()));
  // The path since the last key frame.
  if (way_.T_odom_camera) {
    const Eigen::Isometry3d T_previous_current = way_.T_odom_camera->inverse() * motion.T_odom_camera;
    way_.covariance = carried(T_previous_current.inverse(), way_.covariance) + motion.covariance;
    if (motion.continuous) {
      way_.length += T_previous_current.translation().norm();
      way_.turn += Eigen::AngleAxisd(T_previous_current.linear()).angle();
    }
  }
  way_.known &= motion.continuous;
  way_.T_odom_camera = motion.T_odom_camera;
  if (!isKeyframe(features)) return std::nullopt;

  PlaceReport report;
  report.id = next_id_;
  Stopwatch stopwatch;
  const StereoFeatures kept =
      thinOut(motion.readout != 0.0 ? atStamp(features, motion) : features, options_.max_features);
  const PlaceSignature signature = tools_->index.signature(kept);
  addKeyframe(kept, next_id_++);
  const Place& here = places_.at(report.id);
  report.candidates =
      tools_->index.find(signature, options_.candidates, [&](int id) { return isCandidate(places_.at(id), here); });
  if (!options_.localisation_only) tools_->index.add(report.id, signature);
  report.find_time = stopwatch.lap();
  recognise(here, report);
  report.verify_time = stopwatch.lap();
  forgetOldest();
  return report;
}

/// Whether a place may be the same as a new key frame.
bool PlaceRecognition::isCandidate(const Place& place, const Place& here) const {
  if (expectation_) {
    const Eigen::Vector3d away =
        graph_.nodes().at(place.id).translation() - (expectation_->T_map_odom * here.T_odom_camera).translation();
    if (away.norm() > expectation_->radius) return false;
  }
  return place.segment != here.segment ||
         (static_cast<double>(here.features.stamp - place.features.stamp) * 1e-9 >= options_.min_age &&
          here.travelled - place.travelled >= options_.min_travel);
}

/// Removes the oldest places beyond max_places. With localisation_only, only the newest key frames of this session are
/// kept, and the last loop.
void PlaceRecognition::forgetOldest() {
  constexpr int kKept = 20;
  if (options_.localisation_only) {
    while (static_cast<int>(std::distance(places_.lower_bound(restored_), places_.end())) > kKept) {
      const int oldest = places_.lower_bound(restored_)->first;
      graph_.passLoopsOn(oldest);
      forget(oldest);
    }
    return;
  }
  while (static_cast<int>(places_.size()) > options_.max_places) forget(places_.begin()->first);
}

void PlaceRecognition::forget(int id) {
  tools_->index.remove(id);
  graph_.remove(id);
  places_.erase(id);
  if (recognised_ == id) recognised_.reset();  // the drift counts from the first place that is left
}

/// Whether the last pair becomes a key frame: it is far enough from the last one and has enough features.
bool PlaceRecognition::isKeyframe(const StereoFeatures& features) const {
  constexpr double kTurn = 15.0 * CV_PI / 180.0;  // rad (chosen): most of the view is the last one's
  if (features.count() < PlaceVerifier::kLeastInliers) return false;
  if (!last_ || !way_.known) return true;
  const Eigen::Isometry3d T_keyframe_camera = places_.at(*last_).T_odom_camera.inverse() * *way_.T_odom_camera;
  return T_keyframe_camera.translation().norm() >= options_.keyframe_distance ||
         Eigen::AngleAxisd(T_keyframe_camera.linear()).angle() >= kTurn;
}

void PlaceRecognition::addKeyframe(const StereoFeatures& features, int id) {
  if (!way_.known) ++segment_;
  travelled_ += way_.length;
  Place place;
  place.id = id;
  place.segment = segment_;
  place.travelled = travelled_;
  place.T_odom_camera = *way_.T_odom_camera;
  place.features = features;

  if (places_.empty()) {
    graph_.start(id, place.T_odom_camera);
  } else if (last_ && way_.known) {
    const Eigen::Isometry3d T_last_here = places_.at(*last_).T_odom_camera.inverse() * place.T_odom_camera;
    graph_.extend({*last_, id, GraphEdge::Kind::kOdometry, T_last_here, way_.covariance, way_.length, way_.turn});
  } else {
    const auto& [last, T_map_last] = *graph_.nodes().rbegin();
    const Eigen::Isometry3d T_map_odometry = expectation_ ? expectation_->T_map_odom : T_map_odom();
    const Eigen::Isometry3d T_last_here = T_map_last.inverse() * T_map_odometry * place.T_odom_camera;
    graph_.extend({last, id, GraphEdge::Kind::kBreak, T_last_here, unknown()});
  }
  places_.emplace(id, std::move(place));
  last_ = id;
  way_.covariance.setZero();
  way_.length = way_.turn = 0.0;
  way_.known = true;
}

/// Checks the candidates' geometry, one after the other, until one is the same place. It becomes a loop if one of a
/// neighbouring key frame agrees.
void PlaceRecognition::recognise(const Place& here, PlaceReport& report) {
  report.reason = "no place looks similar";
  for (const PlaceCandidate& candidate : report.candidates) {
    report.match = tools_->verifier.verify(places_.at(candidate.place).features, here.features);
    report.reason = report.match.reason;
    if (!report.match.same) continue;
    const GraphEdge loop{candidate.place, here.id, GraphEdge::Kind::kLoop, report.match.T_place_camera,
                         report.match.covariance};
    if (!isPossible(loop)) {
      report.reason = "the odometry cannot have drifted that far";
      continue;
    }
    report.same = candidate.place;
    const std::vector<GraphEdge> loops = tools_->agreement.confirm(graph_, loop);
    for (const GraphEdge& trusted : loops) graph_.close(trusted);
    report.loop = !loops.empty();
    if (report.loop) {
      recognised_ = candidate.place;
      expectation_.reset();
    }
    report.reason = report.loop ? "" : "no other key frame nearby has confirmed it yet";
    return;
  }
}

/// Whether the correction by a loop is within the drift that the odometry can have on the path between its nodes.
bool PlaceRecognition::isPossible(const GraphEdge& loop) const {
  constexpr double kImpossible = 22.5;  // chi-square of six, 99.9 % (chosen): a false loop costs more than one left out
  const GraphPath path = graph_.path(loop.from, loop.to);
  if (!path.known) return true;
  // The error of a loop may exceed its covariance. Small corrections are always possible; else one inexact loop would
  // make the graph reject all later, better ones.
  const Matrix6d inexact = isotropic(0.5 * 0.5, 0.03 * 0.03);
  const Matrix6d covariance = path.covariance + loop.covariance + graph_.drift(path.length, path.turn) + inexact;
  const Eigen::Isometry3d T_from_to = graph_.nodes().at(loop.from).inverse() * graph_.nodes().at(loop.to);
  const Vector6d correction = logSE3(T_from_to.inverse() * loop.T_from_to);
  return mahalanobisSquare(correction, covariance) <= kImpossible;
}

void PlaceRecognition::expect(const Eigen::Isometry3d& T_map_odom, double radius) {
  if (places_.empty()) return;
  expectation_ = {T_map_odom, radius};
  way_.known = false;
}

std::optional<Matrix6d> PlaceRecognition::covariance() const {
  constexpr double kShare = 0.1;  // of the largest drift (chosen), as a standard deviation
  if (!last_) return std::nullopt;
  const GraphPath path = graph_.path(recognised_.value_or(places_.begin()->first), *last_);
  if (!path.known) return std::nullopt;
  return path.covariance + kShare * kShare * graph_.drift(path.length, path.turn);
}

Eigen::Isometry3d PlaceRecognition::T_map_odom() const {
  if (!last_) return Eigen::Isometry3d::Identity();
  return orthonormalised(graph_.nodes().at(*last_) * places_.at(*last_).T_odom_camera.inverse());
}

PlaceSignature PlaceRecognition::signature(int place) const {
  return tools_->index.signature(places_.at(place).features);
}

std::size_t PlaceRecognition::bytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, place] : places_)
    bytes += place.bytes() +
             2 * sizeof(std::uint32_t) * PlaceIndex::kWordsPerRow * static_cast<std::size_t>(place.features.count());
  return bytes;
}

std::vector<PlaceCandidate> PlaceRecognition::find(const PlaceSignature& signature) const {
  return tools_->index.find(signature, options_.candidates, [](int) { return true; });
}

PlaceMatch PlaceRecognition::verify(int place, const StereoFeatures& features) const {
  return tools_->verifier.verify(places_.at(place).features, thinOut(features, options_.max_features));
}

void PlaceRecognition::restore(std::vector<Place> places, const PoseGraph& graph) {
  if (!places_.empty()) throw std::invalid_argument("places can only be taken up before there are any");
  if (places.empty()) throw std::invalid_argument("there are no places to take up");
  PlaceIndex index;
  std::map<int, Place> restored;
  int segment = 0;
  for (Place& place : places) {
    place.features.check();
    if (place.id < 0 || place.id > kMostNumber || place.segment < 0 || place.segment > kMostNumber)
      throw std::invalid_argument(
          text(0, "place ", place.id, " of segment ", place.segment, " leaves no numbers to go on with"));
    if (graph.nodes().count(place.id) == 0)
      throw std::invalid_argument("place " + std::to_string(place.id) + " is not in the graph");
    if (!restored.empty() && place.features.kind() != restored.begin()->second.features.kind())
      throw std::invalid_argument("places are described by both " + toString(place.features.kind()) + " and " +
                                  toString(restored.begin()->second.features.kind()));
    index.add(place.id, index.signature(place.features));
    segment = std::max(segment, place.segment);
    const int id = place.id;
    restored.emplace(id, std::move(place));
  }
  if (restored.size() != graph.nodes().size()) throw std::invalid_argument("the graph has nodes without a place");
  // The index has an array over all ids from the first place to the last one.
  const int first = restored.begin()->first, last = restored.rbegin()->first;
  if (last - first > kMostApart)
    throw std::invalid_argument(text(0, "places ", first, " and ", last, " cannot be of one map"));
  segment_ = segment;
  places_ = std::move(restored);
  tools_->index = std::move(index);
  graph_ = graph;
  next_id_ = restored_ = places_.rbegin()->first + 1;
  if (options_.localisation_only) graph_.hold(restored_ - 1);
  way_.known = false;
}

}  // namespace sdvo
