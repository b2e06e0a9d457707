#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "../belief/belief.hpp"
#include "../belief/motion_hypotheses.hpp"
#include "../belief/motion_prior.hpp"
#include "../belief/pose_covariance.hpp"
#include "../map/floor.hpp"
#include "../map/local_map.hpp"
#include "../rig/learnt_rig.hpp"
#include "../rig/repeated_images.hpp"
#include "../rig/rolling_shutter.hpp"
#include "outage.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// A pair's state, and its motion since the last pose.
struct OdometryStep {
  TrackingState state = TrackingState::kWaiting;
  std::string reason;
  double probability = std::numeric_limits<double>::quiet_NaN();  ///< that a measured motion is the camera's
  std::optional<Eigen::Isometry3d> T_previous_current;
  Matrix6d covariance = Matrix6d::Zero();  ///< of that motion
  Vector6d correction = Vector6d::Zero();  ///< see OdometryResult
  std::vector<int> rejected_features;      ///< matched features of the pair that the adjustment does not confirm
  double dt = 0.0;                         ///< see OdometryResult, s
  double time = 0.0;                       ///< of computation, s
  bool changes_epoch = false;              ///< the motion is not since the last reported pose

  bool hasPose() const { return state == TrackingState::kTracking || state == TrackingState::kDegraded; }
};

/// A map that another one replaced after an outage, and the last pose in it. Foreign images may have begun the other
/// one, so a lost camera is also looked for in this map.
struct EarlierMap {
  LocalMap map;
  Eigen::Isometry3d T_origin_camera;
  PoseCovariance covariance;
  std::optional<std::int64_t> last_pose_stamp;  ///< ns
  int epoch;
};

/// Alignment of patches under the odometry's noise.
inline PatchAlignmentOptions alignmentWith(const NoiseOptions& noise) {
  PatchAlignmentOptions alignment;
  alignment.noise = noise;
  return alignment;
}

/// The memory of the odometry from pair to pair.
struct OdometryState {
  std::optional<LocalMap> map;
  std::optional<LocalMap> candidate;  ///< the map with the pair; kept to reuse its memory
  /// The map that the newest pair of an outage begins, at the guesses' pose, else at the last pose. It replaces `map`
  /// once the next pair is measured against it.
  std::optional<LocalMap> fallback_map;
  bool fallback_has_pose = false;  ///< its pose is that of the guesses
  std::optional<EarlierMap> earlier;
  std::optional<RolledPair> newest;  ///< that joined the map or the fallback map; only with a rolling shutter
  LearntRig rig;
  RollingShutter shutter;
  MotionPrior prior;
  Doubt doubt;
  Outage outage;
  RepeatedImages images;
  FloorBelief floor;
  std::optional<StereoCamera> camera;      ///< of the map's pixels
  std::optional<std::int64_t> lens_stamp;  ///< ns, of the last pair whose camera_info was not refuted
  std::optional<StereoCamera> lens;        ///< of the last pair's pixels: as camera_info said, unless images refuted it
  std::optional<std::int64_t> last_stamp;
  Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();
  PoseCovariance covariance;                    ///< of that pose
  OdometryResult last_sound;                    ///< the last one with a pose and without a defect
  std::optional<std::int64_t> last_pose_stamp;  ///< ns
  double distance = 0.0;                        ///< m
  int pairs = 0;
  int epoch = 0;
  bool started = false;
  bool frozen = false;       ///< the last images repeat the previous ones although the camera moved
  bool interrupted = false;  ///< the camera's pose in the map is unknown

  OdometryState(const VisualOdometryOptions& options, int first_epoch);

  /// Since the last pair, s; there has to be one. `stamp`: ns.
  double secondsUntil(std::int64_t stamp) const { return static_cast<double>(stamp - *last_stamp) * 1e-9; }

  /// The estimates of the rig start anew.
  void forgetRig(const VisualOdometryOptions& options);
  /// The rig walked by a random step after it was `known`.
  void walkRig(const RigEstimate& known, const RigEstimate::Matrix& step);

  /// The next pair does not continue the last one.
  void interrupt();

  /// A result had a defect, whose cause may be anywhere in the memory: only the last sound pose and what the caller
  /// gave is kept. The next pair starts a map there under a new epoch.
  void recover(const VisualOdometryOptions& options);

  /// A new epoch begins with the fallback map. The unknown motion before it widens the covariance. The map, if any,
  /// becomes the earlier one.
  void startAgain();
  /// The camera is found in the earlier map: epoch and pose are those of that map again.
  void returnToEarlierMap();
  /// The maps are of no use for the next pairs.
  void forgetMaps() { map.reset(), earlier.reset(); }
  /// The fallback map becomes the map.
  void useFallbackMap();

  /// The pair's calibration is new: a map begins with it at the last pose, and the rig's estimates start anew.
  void recalibrate(const VisualOdometryOptions& options, const StereoFeatures& given);

  void move(const Eigen::Isometry3d& T_previous_current);

  /// `given_indices`: for each feature its index in the pair as given.
  OdometryResult report(const StereoFeatures& features, const std::vector<int>& given_indices,
                        const MotionHypothesis& found, const OdometryStep& step,
                        const std::optional<Floor>& known_floor) const;
};

// Steps of pairs whose motion is not measured: unmeasured_step.cpp.

constexpr const char* kStartedAgain = "started again from the last pose; the motion in between is unknown";

/// Begins a map with the pair: the first one, or at the guesses' pose, or at the last pose. While there is a map from
/// before the outage, the odometry is lost until the next pair is found in either.
OdometryStep startMap(const VisualOdometryOptions& options, const StereoFeatures& features, OdometryState& state);

/// Repeated images contain no motion: the pose stays, and the possible motion widens its covariance.
OdometryStep holdPose(double dt, OdometryState& state);

/// Moves the pose by the guess or the velocity, else the odometry is lost. `failure`: why no motion is measured.
OdometryStep predictMotion(const VisualOdometryOptions& options, const StereoFeatures& features, double dt,
                           const std::string& failure, OdometryState& state);

}  // namespace sdvo
