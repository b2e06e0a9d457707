#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "../belief/motion_hypotheses.hpp"
#include "../belief/motion_prior.hpp"
#include "../belief/pose_covariance.hpp"
#include "../map/local_map.hpp"
#include "../rig/learnt_rig.hpp"
#include "../rig/repeated_images.hpp"
#include "../rig/rolling_shutter.hpp"
#include "odometry_step.hpp"
#include "outage.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// A map that another one replaced after an outage, and the last pose in it. Foreign images may have begun the other
/// one, so a lost camera is also looked for in this map.
struct EarlierMap {
  LocalMap map;
  Eigen::Isometry3d T_origin_camera;
  PoseCovariance covariance;
  std::optional<std::int64_t> last_pose_stamp;  ///< ns
  int epoch;
};

/// A pose from which the odometry can go on, whatever else is forgotten.
struct ReportedPose {
  Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Zero();
  double distance = 0.0;              ///< m, travelled up to there
  std::optional<std::int64_t> stamp;  ///< ns; none before the first pose
};

/// The memory of the odometry from pair to pair.
struct OdometryState {
  std::optional<LocalMap> map;
  std::optional<LocalMap> candidate;  ///< the map with the pair; kept to reuse its memory
  /// The map that the newest pair of an outage begins, at the guesses' pose, else at the last pose. It replaces `map`
  /// once the next pair is measured against it.
  std::optional<LocalMap> fallback_map;
  bool fallback_keeps_epoch = false;  ///< its pose is by guesses of whole motions
  std::optional<EarlierMap> earlier;
  std::optional<RolledPair> newest_rolled;  ///< the newest pair of map or fallback map; only with a rolling shutter
  LearntRig rig;
  RollingShutter shutter;
  MotionPrior prior;
  Doubt doubt;
  Outage outage;
  RepeatedImages images;
  FloorBelief floor;
  std::optional<StereoCamera> map_camera;         ///< of the map's pixels
  std::optional<StereoCamera> pair_camera;        ///< SearchedPair::camera of the last pair
  std::optional<std::int64_t> camera_info_stamp;  ///< ns, of the last pair whose camera_info was not refuted
  std::optional<std::int64_t> last_stamp;
  Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();
  PoseCovariance covariance;                    ///< of that pose
  ReportedPose last_sound;                      ///< the last one without a defect
  std::optional<std::int64_t> last_pose_stamp;  ///< ns
  double distance = 0.0;                        ///< m
  int pairs = 0;
  int epoch = 0;
  bool started = false;      ///< there was a map: without one the odometry is lost, not waiting
  bool frozen = false;       ///< the last images repeat the previous ones although the camera moved
  bool interrupted = false;  ///< the camera's pose in the map is unknown

  OdometryState(const VisualOdometryOptions& options, int first_epoch);

  /// Since the last pair, s; there has to be one. `stamp`: ns.
  double secondsUntil(std::int64_t stamp) const { return static_cast<double>(stamp - *last_stamp) * 1e-9; }

  /// The estimates of the rig start anew.
  void forgetRig(const VisualOdometryOptions& options);
  /// The rig walked by a random step of this covariance after it was `known`.
  void walkRig(const RigEstimate& known, const RigEstimate::Matrix& step_covariance);

  /// The next pair does not continue the last one.
  void interrupt();

  /// Forgets all but a pose and what the caller gave. The next pair starts a map there under a new epoch.
  void restartAt(const ReportedPose& pose, const VisualOdometryOptions& options);

  /// A new epoch begins with the fallback map. The unknown motion before it widens the covariance. The map, if any,
  /// becomes the earlier one.
  void startAgain();
  /// The camera is found in the earlier map: epoch and pose are those of that map again.
  void returnToEarlierMap();
  /// The pair's motion is measured in the map.
  void endOutage(bool is_earlier_map);
  /// The maps are of no use for the next pairs.
  void forgetMaps() { map.reset(), earlier.reset(); }
  /// The fallback map becomes the map.
  void useFallbackMap();

  /// The pair's calibration is new: a map begins with it at the last pose, and the rig's estimates start anew.
  void recalibrate(const VisualOdometryOptions& options, const StereoFeatures& given);

  void move(const Eigen::Isometry3d& T_previous_current);
  ReportedPose lastPose() const;

  OdometryResult report(const SearchedPair& pair, const OdometryStep& step,
                        const std::optional<Floor>& known_floor) const;
};

}  // namespace sdvo
