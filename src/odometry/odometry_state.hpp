#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "../belief/belief.hpp"
#include "../belief/motion_hypotheses.hpp"
#include "../belief/pose_covariance.hpp"
#include "../rig/learnt_rig.hpp"
#include "../rig/repeated_images.hpp"
#include "stereo_descriptor_vo/belief/motion_prior.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/map/floor.hpp"
#include "stereo_descriptor_vo/map/local_map.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"
#include "stereo_descriptor_vo/odometry/outage.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry_options.hpp"

namespace sdvo {

/// State and motion that a pair adds to the pose.
struct OdometryStep {
  TrackingState state = TrackingState::kWaiting;
  std::string reason;
  double probability = std::numeric_limits<double>::quiet_NaN();  ///< that a measured motion is the camera's
  std::optional<Eigen::Isometry3d> T_previous_current;
  Matrix6d covariance = Matrix6d::Zero();  ///< of that motion
  Vector6d correction = Vector6d::Zero();  ///< the part of it that the map corrects
  std::vector<int> rejected_features;      ///< matched features of the pair that the adjustment does not confirm
  double dt = 0.0;                         ///< over which that motion is, else since the previous pair, s
  double time = 0.0;                       ///< s
  bool starts_again = false;               ///< that motion began at no pose that was reported

  bool hasPose() const { return state == TrackingState::kTracking || state == TrackingState::kDegraded; }
};

/// The memory of the odometry from pair to pair.
struct OdometryState {
  std::optional<LocalMap> map;
  std::optional<LocalMap> candidate;  ///< the map with the pair; between pairs only its memory matters.
  /// The map that the newest pair of an outage would begin. It is placed where the guesses have the camera, else at the
  /// last pose. It becomes the map once the next pair is measured against it.
  std::optional<LocalMap> seed;
  bool seed_has_pose = false;  ///< guesses have the motion from the map to the seed
  LearntRig rig;
  MotionPrior prior;
  Doubt doubt;
  Outage outage;
  RepeatedImages images;
  FloorBelief floor;
  std::optional<StereoCamera> camera;
  std::optional<std::int64_t> last_stamp;
  Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();
  PoseCovariance covariance;                    ///< of that pose
  std::optional<std::int64_t> last_pose_stamp;  ///< ns
  double distance = 0.0;                        ///< m
  int pairs = 0;
  int epoch = 0;
  bool started = false;
  bool frozen = false;       ///< the last images repeated those before although the camera moved
  bool interrupted = false;  ///< where in the map the camera is is unknown

  OdometryState(const VisualOdometryOptions& options, int first_epoch);

  /// Another rig: its estimates start anew.
  void forgetRig(const VisualOdometryOptions& options);

  /// The next pair does not continue the last one.
  void interrupt();

  /// A new epoch begins at the seed: the camera's motion before it is unknown.
  void startAgain();
  /// The seed becomes the map.
  void takeSeed();

  void move(const Eigen::Isometry3d& T_previous_current);

  /// `given_indices`: of each feature in the pair as it was given.
  OdometryResult report(const StereoFeatures& features, const std::vector<int>& given_indices,
                        const MotionHypothesis& found, const OdometryStep& step,
                        const std::optional<Floor>& known_floor) const;
};

// Steps of pairs whose motion is not measured: unmeasured_step.cpp.

constexpr const char* kStartedAgain = "started again from the last pose; the motion in between is unknown";

/// The pair begins a map: the first one, or where the guesses have the camera, or at the last pose. While there is a
/// map from before, the odometry is lost until the next pair is found in either.
OdometryStep startMap(const VisualOdometryOptions& options, const StereoFeatures& features, OdometryState& state);

/// Images that repeat themselves show no motion: the pose stays, as uncertain as the prior makes it meanwhile.
OdometryStep holdPose(double dt, OdometryState& state);

/// The motion by the guess or by the velocity; without them the odometry is lost. `failure`: why it is not measured.
OdometryStep predictMotion(const VisualOdometryOptions& options, const StereoFeatures& features, double dt,
                           const std::string& failure, OdometryState& state);

}  // namespace sdvo
