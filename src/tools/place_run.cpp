#include "place_run.hpp"

#include <algorithm>
#include <ctime>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "../common/statistics.hpp"
#include "../common/stopwatch.hpp"
#include "../common/text.hpp"
#include "../data/text_file.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

void PlaceRun::process(const StereoFeatures& features, const OdometryResult& odometry) {
  const int number = static_cast<int>(pairs_.size() - first_pair_);
  pairs_.push_back({static_cast<int>(keyframes_.size()) - 1,
                    odometry.has_pose || pairs_.empty() ? odometry.T_origin_camera : pairs_.back().T_odom_camera});
  if (!odometry.has_pose) return;
  const std::clock_t cpu_before = std::clock();
  CameraMotion motion{odometry.T_origin_camera, odometry.motion_covariance, odometry.has_motion || !had_pose_};
  motion.readout = odometry.used_readout;
  if (odometry.has_motion) motion.velocity = logSE3(odometry.T_previous_current) / odometry.dt;
  had_pose_ = true;
  const auto report = recognition_.observe(features, motion);
  if (report && report->loop) {
    Stopwatch stopwatch;
    PoseGraph graph = recognition_.graph();
    graph.optimise();
    recognition_.adopt(graph);
    longest_optimisation_ = std::max(longest_optimisation_, 1e3 * stopwatch.lap());
  }
  cpu_time_ += 1e3 * static_cast<double>(std::clock() - cpu_before) / CLOCKS_PER_SEC;
  if (!report) return;
  pairs_.back().keyframe = static_cast<int>(keyframes_.size());
  keyframes_.push_back({number, *report});
}

void PlaceRun::startSequence() {
  first_pair_ = pairs_.size();
  first_keyframe_ = keyframes_.size();
}

Trajectory PlaceRun::poses() const {
  Trajectory poses;
  for (std::size_t i = first_pair_; i < pairs_.size(); ++i) {
    const auto& [keyframe, T_odom_camera] = pairs_[i];
    Eigen::Isometry3d T_map_odom = Eigen::Isometry3d::Identity();
    if (keyframe >= 0) {
      const Place& place = recognition_.places().at(keyframes_[keyframe].report.id);
      T_map_odom = recognition_.graph().nodes().at(place.id) * place.T_odom_camera.inverse();
    }
    poses.push_back(orthonormalised(T_map_odom * T_odom_camera));
  }
  return poses;
}

bool PlaceRun::isRevisit(const Trajectory& truth, const Keyframe& keyframe) const {
  constexpr double kNear = 5.0, kSameDirection = 30.0;  // m, deg
  const Place& here = recognition_.places().at(keyframe.report.id);
  return std::any_of(ownKeyframes(), keyframes_.end(), [&](const Keyframe& other) {
    const Place& place = recognition_.places().at(other.report.id);
    if (static_cast<double>(here.features.stamp - place.features.stamp) * 1e-9 < options_.min_age ||
        here.travelled - place.travelled < options_.min_travel)
      return false;
    const Eigen::Isometry3d T = truth[other.pair].inverse() * truth[keyframe.pair];
    return T.translation().norm() <= kNear && degreesOf(T.linear()) <= kSameDirection;
  });
}

PlaceErrors PlaceRun::errors(const Trajectory& truth) const {
  constexpr double kWrong = 1.0, kWrongAngle = 5.0;  // m, deg
  const std::size_t pairs = pairs_.size() - first_pair_;
  if (truth.size() < pairs)
    throw std::invalid_argument(text(0, "--poses has ", truth.size(), " poses for ", pairs, " pairs"));
  PlaceErrors errors;
  std::map<int, int> pair_of;
  for (auto keyframe = ownKeyframes(); keyframe != keyframes_.end(); ++keyframe)
    pair_of[keyframe->report.id] = keyframe->pair;
  std::set<int> recognised;
  for (const GraphEdge& edge : recognition_.graph().edges()) {
    if (edge.kind != GraphEdge::Kind::kLoop || pair_of.count(edge.to) == 0) continue;
    ++errors.loops;
    if (pair_of.count(edge.from) == 0) {
      ++errors.false_loops;
      continue;
    }
    recognised.insert(edge.to);
    const Eigen::Isometry3d T_true = truth[pair_of.at(edge.from)].inverse() * truth[pair_of.at(edge.to)];
    const Eigen::Isometry3d error = T_true.inverse() * edge.T_from_to;
    const double turn = degreesOf(error.linear());
    errors.false_loops += error.translation().norm() > kWrong || turn > kWrongAngle;
    errors.worst_translation = std::max(errors.worst_translation, error.translation().norm());
    errors.worst_rotation = std::max(errors.worst_rotation, turn);
  }
  for (auto keyframe = ownKeyframes(); keyframe != keyframes_.end(); ++keyframe) {
    if (!isRevisit(truth, *keyframe)) continue;
    ++errors.revisits;
    errors.recognised += recognised.count(keyframe->report.id) > 0;
  }
  Trajectory before;
  for (std::size_t i = first_pair_; i < pairs_.size(); ++i) before.push_back(pairs_[i].T_odom_camera);
  errors.ate_before = evaluateTrajectory(truth, before).ate_aligned_m;
  errors.ate_after = evaluateTrajectory(truth, poses()).ate_aligned_m;
  return errors;
}

double PlaceRun::keyframeTime(double quantile) const {
  std::vector<double> times;
  for (const Keyframe& keyframe : keyframes_)
    times.push_back(1e3 * (keyframe.report.find_time + keyframe.report.verify_time));
  return sdvo::quantile(std::move(times), quantile);
}

double PlaceRun::cpuTime() const {
  return pairs_.empty() ? 0.0 : cpu_time_ / static_cast<double>(pairs_.size());
}

void PlaceRun::writeKeyframes(const std::string& path) const {
  std::ostringstream file;
  file << "id,pair,stamp_ns,features,best,score,same,matches,inliers,coverage,rms_px,loop,find_ms,verify_ms,reason\n";
  for (const auto& [pair, report] : keyframes_) {
    const bool any = !report.candidates.empty();
    file << report.id << "," << pair << "," << recognition_.places().at(report.id).features.stamp << ","
         << recognition_.places().at(report.id).features.count() << "," << (any ? report.candidates.front().place : -1)
         << "," << (any ? report.candidates.front().score : 0.0) << "," << report.same.value_or(-1) << ","
         << report.match.matches << "," << report.match.inliers << "," << report.match.coverage << ","
         << report.match.rms << "," << report.loop << "," << 1e3 * report.find_time << "," << 1e3 * report.verify_time
         << "," << report.reason << "\n";
  }
  writeTextFile(path, file.str());
}

}  // namespace sdvo
