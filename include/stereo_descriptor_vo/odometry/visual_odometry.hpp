#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/calibration_filter.hpp"
#include "stereo_descriptor_vo/odometry/feature_matcher.hpp"
#include "stereo_descriptor_vo/odometry/floor.hpp"
#include "stereo_descriptor_vo/odometry/local_map.hpp"
#include "stereo_descriptor_vo/odometry/motion_hypotheses.hpp"
#include "stereo_descriptor_vo/odometry/motion_prior.hpp"
#include "stereo_descriptor_vo/odometry/motion_search.hpp"
#include "stereo_descriptor_vo/odometry/noise.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"
#include "stereo_descriptor_vo/odometry/patch_alignment.hpp"
#include "stereo_descriptor_vo/odometry/pose_covariance.hpp"
#include "stereo_descriptor_vo/odometry/reacquisition.hpp"
#include "stereo_descriptor_vo/odometry/repeated_images.hpp"
#include "stereo_descriptor_vo/odometry/revisit.hpp"
#include "stereo_descriptor_vo/odometry/right_camera_delay.hpp"
#include "stereo_descriptor_vo/odometry/right_camera_rotation.hpp"
#include "stereo_descriptor_vo/odometry/row_readout.hpp"

namespace sdvo {

struct TrackingOptions : MotionPriorOptions {
  int max_predicted_pairs = 1;
  double max_gap = 1.0;
  double max_guessed = 10.0;
  double probability = 0.95;
  double doubtful_deviation = 0.05;

  void describe(OptionList& list) {
    list.add("max_predicted_pairs", max_predicted_pairs, {0, 100}, "",
             "pairs in a row whose motion may be predicted before the odometry is lost");
    list.add("max_gap", max_gap, {0.01, 60.0}, "s", "longest time between pairs over which the motion is predicted");
    list.add(
        "max_guessed", max_guessed, {0.0, 1000.0}, "s",
        "longest time without usable images over which the pose goes on by the guess of another odometry; by a gyro "
        "over max_gap");
    list.add("probability", probability, {0.5, 0.999}, "",
             "a motion is doubtful that is the camera's with a smaller probability");
    list.add(
        "doubtful_deviation", doubtful_deviation, {0.001, 1000.0}, "m",
        "a motion is doubtful whose translation has a larger standard deviation than this and 3 % of its distance");
    MotionPriorOptions::describe(list);
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

/// How the camera moved since the pair before, as something else than the images has it.
struct MotionGuess {
  Eigen::Isometry3d T_previous_current = Eigen::Isometry3d::Identity();
  bool rotation_only = false;  ///< a gyro's: of the translation it says nothing
  double error =
      0.1;  ///< standard deviation of distance and turn, as ratios of them; it is a scale: all guesses share it
};

/// Motion since the last measured pose, as guesses have it.
class GuessedMotion {
 public:
  /// The covariance of the guess, a right perturbation in m and rad, that comes on top of those before it.
  Matrix6d add(const MotionGuess& guess);

 private:
  double distance_ = 0.0, angle_ = 0.0;  ///< m, rad
};

/// Stereo odometry on stereo features alone. Every pair is matched to a local map of the points around the camera,
/// separated from outliers by sample consensus, and adjusted together with the last key frames.
class VisualOdometry {
 public:
  /// Throws std::invalid_argument when an option is out of its range.
  explicit VisualOdometry(const VisualOdometryOptions& options);

  /// Processes the next pair. Stamps must increase and the features must pass check(), else std::invalid_argument and
  /// the state is as before. `guess` is one more place to look for the motion; it is never taken for a measurement.
  /// Each pair may have a camera of its own: one that isLike() the first one's goes on, another one starts a new epoch.
  OdometryResult update(const StereoFeatures& features, const std::optional<MotionGuess>& guess = std::nullopt);

  /// Back to the initial pose and a new epoch; nothing is remembered.
  void reset();

  /// Tells that the next pair does not continue the last one (a pause, a restarted source). The odometry goes on where
  /// it finds the pair in its map, else from the last pose under a new epoch.
  void breakStream();

  /// Tells that something else has the last pose, with this covariance (of its right perturbation): a new epoch begins.
  /// The map is kept, unless the camera's place in it is unknown: then the next pair starts a map at the last pose.
  void takePose(const Matrix6d& covariance);

  /// T_origin_camera of the last pair that had a pose.
  const Eigen::Isometry3d& lastPose() const { return state_.T_origin_camera; }

  /// Tells that the clock was set: as breakStream(), and the next stamp may be any.
  void forgetTime();

  /// Takes other options over while running. Those of `map` take effect at the next start, those of
  /// `calibration` when the estimate begins anew (a reset, another camera, a pair that the rig monitor refused).
  /// Throws std::invalid_argument, and keeps the old ones, when an option is out of its range.
  void configure(const VisualOdometryOptions& options);

  const VisualOdometryOptions& options() const { return options_; }

  /// Where the camera sits on the base, whose floor `planar` is about; until then at the base's origin, looking ahead.
  /// Another place on the way is that of another camera. The odometry goes on from the base's last pose under a new
  /// epoch. The origin is where this camera was in the beginning.
  void mountAt(const Eigen::Isometry3d& T_base_camera);

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
    double dt = 0.0;                         ///< over which that motion is, else since the previous pair, s
    double time = 0.0;                       ///< s
  };

  /// The map as it would be with the pair, adjusted. Nothing has changed until it is committed.
  struct Candidate {
    RigCalibration calibration;
    LocalMap::Adjustment adjustment;
    Eigen::Isometry3d motion;             ///< T_reference_current after the adjustment
    Eigen::Isometry3d T_keyframe_origin;  ///< of the key frame before the pair, before the adjustment
    double distance = 0.0;                ///< from that key frame, m
  };

  /// Whether a motion is the camera's.
  struct Doubt {
    double probability = 1.0;            ///< that it is
    double log_odds = 0.0;               ///< that it is not, by the pair alone
    Matrix6d moment = Matrix6d::Zero();  ///< of the alternatives around the motion, by their probabilities, m and rad
    std::string reason, cause;           ///< in words, of the likeliest alternative, for this pair and for the next
  };

  void refuse(const StereoFeatures& features) const;
  bool isFrozen(const StereoFeatures& features, double dt, const std::optional<MotionGuess>& guess) const;
  std::optional<MotionScene> reacquire(const StereoFeatures& features) const;
  void forgetRig();
  void begin(const StereoFeatures& features, double dt);
  void endOutage();
  Step seed(const StereoFeatures& features);
  MotionScene sceneOf(const StereoFeatures& features, double dt, const std::optional<MotionGuess>& guess) const;
  std::optional<StereoFeatures> inStep(const StereoFeatures& taken, double dt,
                                       const std::optional<MotionGuess>& guess) const;
  void watchShutters(const StereoFeatures& taken, double dt, const MotionHypothesis& found);
  double largestDoubt() const;
  double secondsSinceMap(const StereoFeatures& features) const;
  Step extendMap(const StereoFeatures& features, const MotionScene& scene, MotionHypothesis& found, double dt);
  void learn(const MotionHypothesis& confirmed);
  Candidate adjust(const StereoFeatures& features, const MotionHypothesis& found, bool may_recall);
  Doubt doubtOf(const MotionScene& scene, const MotionHypothesis& found) const;
  std::string innovationWords(const MotionHypothesis& found) const;
  void judge(const MotionScene& scene, const MotionHypothesis& found, const Candidate& candidate, const Doubt& doubt,
             Step& step);
  void commit(const Candidate& candidate, double probability);
  Step measure(const MotionHypothesis& found, const Candidate& candidate);
  Step hold(double dt);
  Step predict(const StereoFeatures& features, double dt, const std::string& failure);
  Eigen::Isometry3d motionOf(const MotionGuess& guess, double dt) const;
  Matrix6d unseen(double dt) const;
  void follow(const std::optional<MotionGuess>& guess, double dt);
  bool canFollow(const StereoFeatures& features) const;
  std::optional<Floor> floor() const;
  void move(const Eigen::Isometry3d& T_previous_current);
  OdometryResult report(const StereoFeatures& features, const MotionHypothesis& found, const Step& step) const;
  void reportMatches(const StereoFeatures& features, const MotionHypothesis& found, const Step& step,
                     OdometryResult& result) const;

  VisualOdometryOptions options_;
  Eigen::Isometry3d T_base_camera_;
  MotionSearch search_;
  Reacquisition reacquisition_;
  Revisit revisit_;
  WindowOptimizer optimizer_;

  // State between pairs; reset() is the assignment of a new one.
  struct State {
    explicit State(const VisualOdometryOptions& options);

    std::optional<LocalMap> map;
    std::optional<LocalMap> candidate;  ///< the map with the pair; between pairs only its memory matters
    CalibrationFilter calibration;
    RightCameraRotation right_rotation;
    RightCameraDelay right_delay;
    RowReadout readout;
    std::optional<StereoCamera> camera;
    std::optional<std::int64_t> last_stamp;
    Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();
    PoseCovariance covariance;  ///< of that pose
    MotionPrior prior;
    CarriedDoubt doubt;
    Noise noise;
    double usual_agreement = 0.9;  ///< ratio of lasting matches that agree with confirmed motions
    FloorBelief floor;
    RepeatedImages images;
    std::int64_t last_pose_stamp = 0;  ///< ns
    double distance = 0.0;
    int predicted_pairs = 0;
    double unseen = 0.0;  ///< s since the last measured motion
    int pairs = 0;
    /// Since the last pose, as guesses have it, and its covariance; nothing while one is missing.
    struct Followed {
      Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
      Matrix6d covariance = Matrix6d::Zero();
      bool rotation_only = false;  ///< the translation is the prior's
    };
    std::optional<Followed> followed = Followed();
    GuessedMotion guessed;
    bool started = false;
    bool interrupted = false;  ///< where in the map the camera is is unknown
  } state_;
  int epoch_ = 0;
};

}  // namespace sdvo
