#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/calibration_filter.hpp"
#include "stereo_descriptor_vo/odometry/feature_matcher.hpp"
#include "stereo_descriptor_vo/odometry/floor.hpp"
#include "stereo_descriptor_vo/odometry/local_map.hpp"
#include "stereo_descriptor_vo/odometry/motion_estimator.hpp"
#include "stereo_descriptor_vo/odometry/motion_search.hpp"
#include "stereo_descriptor_vo/odometry/patch_alignment.hpp"
#include "stereo_descriptor_vo/odometry/pose_covariance.hpp"
#include "stereo_descriptor_vo/odometry/pose_verdict.hpp"
#include "stereo_descriptor_vo/odometry/residual_level.hpp"
#include "stereo_descriptor_vo/odometry/right_camera_rotation.hpp"

namespace sdvo {

struct TrackingOptions : PoseVerdictOptions {
  int max_predicted_pairs = 1;
  double max_gap = 1.0;

  void describe(OptionList& list) {
    list.add("max_predicted_pairs", max_predicted_pairs, {0, 100}, "",
             "pairs in a row whose motion may be predicted before the odometry is lost");
    list.add("max_gap", max_gap, {0.01, 60.0}, "s", "longest time between pairs over which the motion is predicted");
    PoseVerdictOptions::describe(list);
  }
};

struct VisualOdometryOptions {
  FeatureMatcherOptions matcher;
  MotionEstimatorOptions motion;
  PatchAlignmentOptions alignment;
  LocalMapOptions map;
  WindowOptimizerOptions window;
  CalibrationOptions calibration;
  TrackingOptions tracking;
  PlanarOptions planar;

  void describe(OptionList& list) {
    list.collect(planar);
    list.group("matcher", matcher);
    list.group("motion", motion);
    list.group("alignment", alignment);
    list.group("map", map);
    list.group("window", window);
    list.group("calibration", calibration);
    list.group("tracking", tracking);
  }
};

enum class TrackingState { kWaiting, kTracking, kDegraded, kLost };

const char* toString(TrackingState state);

/// Where a matched feature was in the last pair that was measured, as the local map tells, and where it is now.
struct FeatureFlow {
  float u_previous, v_previous;  ///< px, left image
  int current;                   ///< row of the pair's features
  bool inlier;                   ///< agrees with the motion that was found, used or not, and with the map
};

/// What one pair did to the odometry. Everything published is derived from this one object.
struct OdometryResult {
  TrackingState state = TrackingState::kWaiting;
  std::string reason;      ///< in words, for every state but plain tracking
  std::int64_t stamp = 0;  ///< of the left image, ns
  int epoch = 0;           ///< one more after every discontinuity of the pose

  bool has_pose = false;  ///< false while waiting or lost: nothing may be published then
  Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();  ///< origin: the first left camera
  Matrix6d pose_covariance = Matrix6d::Zero();  ///< of a right perturbation: T_origin_camera * exp(xi), m and rad

  bool has_motion = false;  ///< false for the first pair and right after a discontinuity
  double dt = 0.0;          ///< s since the previous pair
  Eigen::Isometry3d T_previous_current = Eigen::Isometry3d::Identity();
  Matrix6d motion_covariance = Matrix6d::Zero();  ///< of a right perturbation of T_previous_current
  /// The part of that motion which is the map's second thought about the previous pose: another right perturbation.
  Vector6d correction = Vector6d::Zero();

  int features = 0, matches = 0, inliers = 0;
  double coverage = 0.0;  ///< share of an 8x4 grid's cells over the image that hold an inlier
  double rms = 0.0;  ///< of the corners that agreed on the motion, before alignment and adjustment, px per coordinate
  double match_time = 0.0, motion_time = 0.0;  ///< s
  double distance = 0.0;                       ///< travelled since the start or reset, m
  int keyframe_id = 0;            ///< running number of the map's last key frame, this pair included; 0 without a map
  std::vector<FeatureFlow> flow;  ///< of all matches

  /// The rig's residual errors as estimated so far, with standard deviations; NaN until there is an estimate.
  double disparity_offset = std::numeric_limits<double>::quiet_NaN();        ///< in the image centre, px; compensated
  double disparity_offset_sigma = std::numeric_limits<double>::quiet_NaN();  ///< px
  double disparity_bend = std::numeric_limits<double>::quiet_NaN();  ///< its change at 45 degrees, px; compensated
  double disparity_bend_sigma = std::numeric_limits<double>::quiet_NaN();                                      ///< px
  Eigen::Vector3d right_rotation = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());        ///< rad
  Eigen::Vector3d right_rotation_sigma = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< rad
};

/// How the camera moved since the pair before, as something else than the images has it.
struct MotionGuess {
  Eigen::Isometry3d T_previous_current = Eigen::Isometry3d::Identity();
  bool rotation_only = false;  ///< a gyro's: of the translation it says nothing
};

/// Stereo odometry on stereo features alone: every pair is matched to a local map of the points around the camera,
/// found among its outliers by sample consensus, and adjusted together with the last key frames.
class VisualOdometry {
 public:
  /// Throws std::invalid_argument when an option is out of its range.
  explicit VisualOdometry(const VisualOdometryOptions& options);

  /// Processes the next pair. Stamps must increase and the features must pass check(), else std::invalid_argument and
  /// the state is as before. `guess` is one more place to look for the motion; it is never taken for a measurement.
  OdometryResult update(const StereoFeatures& features, const std::optional<MotionGuess>& guess = std::nullopt);

  /// Back to the initial pose and a new epoch; nothing is remembered.
  void reset();

  /// Tells that the next pair does not continue the last one (another calibration, a restarted source): the odometry
  /// re-seeds from the last pose under a new epoch.
  void breakStream();

  /// Tells that the clock was set: as breakStream(), and the next stamp may be any.
  void forgetTime();

  /// Takes other options over while running. Those of `map` take effect at the next start, those of
  /// `calibration` when the estimate begins anew (a reset, another camera, a pair that the rig monitor refused).
  /// Throws std::invalid_argument, and keeps the old ones, when an option is out of its range.
  void configure(const VisualOdometryOptions& options);

  const VisualOdometryOptions& options() const { return options_; }

  /// Where the camera sits on the base, whose floor `planar` is about; until then at the base's origin, looking ahead.
  void mountAt(const Eigen::Isometry3d& T_base_camera) { T_base_camera_ = T_base_camera; }

  /// The local map's points at a finite distance, in the origin, m; empty while there is no map.
  std::vector<Eigen::Vector3d> mapPoints() const;

 private:
  /// What becomes of the pose with a pair.
  struct Step {
    TrackingState state = TrackingState::kWaiting;
    std::string reason;
    std::optional<Eigen::Isometry3d> T_previous_current;
    Matrix6d covariance = Matrix6d::Zero();  ///< of that motion
    Vector6d correction = Vector6d::Zero();  ///< the part of it that the map corrects
    std::vector<int> rejected_rows;          ///< matched rows of the pair that the adjustment does not confirm
    double time = 0.0;                       ///< s
  };

  /// What became of the map with a pair.
  struct Extension {
    Eigen::Isometry3d T_previous_origin;  ///< of the map's newest pair before, as known then
    Eigen::Isometry3d T_keyframe_origin;  ///< of the last key frame before the newest pair, before the adjustment
    RigCalibration calibration;
    LocalMap::Adjustment adjustment;
  };

  void refuse(const StereoFeatures& features) const;
  void watch(int pairs);
  MotionHypothesis localise(const StereoFeatures& features, double dt, const std::optional<MotionGuess>& guess) const;
  double velocityAge() const;
  bool isFrozen(const StereoFeatures& features, double dt, const std::optional<MotionGuess>& guess) const;
  Step seed(const StereoFeatures& features);
  Step extendMap(const StereoFeatures& features, double dt, const MotionHypothesis& found);
  Extension insert(const StereoFeatures& features, const MotionHypothesis& found);
  PoseEvidence gatherEvidence(const StereoFeatures& features, const MotionHypothesis& found,
                              Extension& extension) const;
  bool isWatched(const PoseEvidence& evidence);
  void measure(double dt, const MotionHypothesis& found, const PoseEvidence& evidence, Trust trust,
               Extension& extension, Step& step);
  void noteVelocity(std::int64_t stamp, const MotionHypothesis& found, const PoseEvidence& evidence, Trust trust,
                    const Matrix6d& covariance);
  Matrix6d doubt(const MotionHypothesis& found, const Extension& extension, const Eigen::Isometry3d& T_previous_current,
                 double dt) const;
  void recall(const StereoFeatures& features);
  void cover(Step& step);
  Step predict(const StereoFeatures& features, double dt, const std::string& failure);
  std::optional<Floor> floor() const;
  void noteFloor(Step& step);
  void move(const Eigen::Isometry3d& T_previous_current);
  OdometryResult report(const StereoFeatures& features, double dt, const MotionHypothesis& found,
                        const Step& step) const;

  VisualOdometryOptions options_;
  Eigen::Isometry3d T_base_camera_;
  MotionSearch search_;
  FeatureMatcher matcher_;  ///< of recalled key frames, as is the next
  MotionEstimator estimator_;
  WindowOptimizer optimizer_;

  // State between pairs; reset() is the assignment of a new one.
  struct State {
    explicit State(const CalibrationOptions& options) : calibration(options) {}

    std::optional<LocalMap> map;
    CalibrationFilter calibration;
    RightCameraRotation right_rotation;
    std::optional<StereoCamera> camera;
    std::optional<std::int64_t> last_stamp;
    Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();
    PoseCovariance covariance;                        ///< of that pose
    std::optional<Vector6d> velocity;                 ///< of the camera in its own frame, m/s and rad/s
    std::optional<Vector6d> last_velocity;            ///< the last one that was not in doubt, kept while lost
    std::int64_t velocity_stamp = 0;                  ///< of the pair that it was measured in, ns
    Matrix6d velocity_covariance = Matrix6d::Zero();  ///< of the velocity as it was measured, 1/s^2
    std::int64_t last_pose_stamp = 0;                 ///< ns
    double distance = 0.0;
    double interval = 0.0;  ///< the longest time between two of the last pairs, s
    int predicted_pairs = 0;
    int pairs = 0;
    bool started = false;
    double floor_height = 0.0;                    ///< m, in the axes of the base's first pose
    bool on_floor = true;                         ///< the last pose
    int level_pairs = 0;                          ///< at another height, one after the other
    ResidualLevel outlier_level;                  ///< shares of the last pairs' matches that did not agree
    Matrix6d last_doubt = Matrix6d::Zero();       ///< of a doubtful motion
    Vector6d correction_left = Vector6d::Zero();  ///< by the map, which the next motion is expected to contain
    int contested_pairs = 0;                      ///< for which a second motion is still to be looked for
    bool frozen = false;                      ///< the last pair showed what the one before did, while the camera moved
    std::array<std::vector<float>, 3> image;  ///< u, v and disparity of the last pair's features, to recognise that
  } state_;
  int epoch_ = 0;
};

}  // namespace sdvo
