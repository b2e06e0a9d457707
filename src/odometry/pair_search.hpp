#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "../belief/motion_search.hpp"
#include "../map/reacquisition.hpp"
#include "odometry_state.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/motion_guess.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// Searches of a motion near a prediction, and of a place after an outage, with the odometry's options.
struct SearchTools {
  explicit SearchTools(const VisualOdometryOptions& options);

  MotionSearch motions;
  Reacquisition places;
};

/// Log-odds that a motion is not the camera's, above which it is doubtful.
double largestDoubt(const TrackingOptions& tracking);

/// The search of one pair's motion: in the map's camera, without repeated rows, with the right image rotated back and
/// synchronous, all rows of one moment. The state does not change; state and features must outlive the search.
class PairSearch {
 public:
  PairSearch(const VisualOdometryOptions& options, const SearchTools& tools, const OdometryState& state,
             const StereoFeatures& given, const std::optional<MotionGuess>& guess);
  PairSearch(const PairSearch&) = delete;  // its parts refer to each other
  PairSearch& operator=(const PairSearch&) = delete;

  // The features on their way, each without the error before it, where there is one:
  // given -> whole(), in the map's pixels -> part(), without repeated rows -> taken(), rotated back -> inStep(), left
  // and right at one moment -> features(), all rows at one moment.

  enum Kind {
    kNoMap,        ///< no map of its camera: it begins one
    kAfterOutage,  ///< its pose in the map is unknown: it is looked for in all maps
    kFrozen,       ///< its images repeat although the camera moved: nothing is searched
    kContinues,    ///< the pair before has a pose in the map: the motion is searched near the expected one
  };
  Kind kind() const { return kind_; }

  double dt() const { return dt_; }  ///< since the previous pair, s
  /// That its images repeat although the camera moved.
  double logOddsOfFrozen() const { return log_odds_of_frozen_; }

  /// All features in the map's camera.
  const StereoFeatures& whole() const { return refocused_ ? *refocused_ : given_; }
  /// Features without those that repeat the previous pair's; the right camera's learnt rotation is undone.
  const StereoFeatures& taken() const { return rotated_back_ ? *rotated_back_ : part(); }
  /// The same at the left image's moment, in all rows: the motion is found with these.
  const StereoFeatures& features() const { return global_ ? *global_ : inStep(); }
  /// For each of features() its index in the pair as given.
  const std::vector<int>& givenIndices() const { return new_features_; }
  bool repeatsAPart() const { return new_part_.has_value(); }
  /// The camera whose pixels these are: the pair's, or that of the pair before if the images refute a change.
  const StereoCamera& lens() const { return lens_; }
  bool refutesCamera() const { return lens_ != given_.camera; }

  /// New rotation of the right camera, for which features are compensated if it is likely.
  const RotationHypothesis& rotation() const { return rotation_; }
  /// The pair before its rows were moved to the stamp; only with a rolling shutter.
  std::optional<RolledPair>& rolled() { return rolled_; }

  /// Where the motion is searched; none for a first pair or a frozen one.
  const std::optional<MotionScene>& scene() const { return scene_; }
  const MotionHypothesis& found() const { return found_; }
  MotionHypothesis& found() { return found_; }

 private:
  const StereoFeatures& part() const { return new_part_ ? *new_part_ : whole(); }
  /// Both sides at the left image's moment, if a delay is known.
  const StereoFeatures& inStep() const { return synchronised_ ? *synchronised_ : taken(); }

  void take(const StereoCamera& lens);
  void searchBy(const StereoCamera& lens);
  bool movesFeatures(const StereoCamera& before) const;
  double logLikelihood() const;
  std::optional<Eigen::Isometry3d> expectedMotion(const std::optional<MotionGuess>& guess) const;
  double findRepeated() const;
  void compensate(const Eigen::Vector3d& new_rotation);
  std::optional<StereoFeatures> synchronised(const Vector6d& velocity) const;
  void roll(const Vector6d& velocity);
  bool rollAgain();
  // Each repeats the one before it with features that are compensated better.
  Vector6d find();
  Vector6d findSynchronised();
  Vector6d findGlobal();
  RotationHypothesis rotationBeyond(const Eigen::Vector3d& compensated);
  void findRotated();
  void tryYaw();
  MotionScene sceneOf(const LocalMap& map, double dt, const std::optional<MotionGuess>& guess) const;
  std::optional<MotionScene> reacquired() const;

  const VisualOdometryOptions& options_;
  const SearchTools& tools_;
  const OdometryState& state_;
  const StereoFeatures& given_;
  const std::optional<MotionGuess>& guess_;
  StereoCamera lens_;
  Kind kind_ = kNoMap;
  double dt_ = 0.0;
  double log_odds_of_frozen_ = kUnsuspected;
  std::vector<int> new_features_;
  std::optional<StereoFeatures> refocused_, new_part_, rotated_back_, synchronised_;
  std::optional<RolledPair> rolled_;      // only with a rolling shutter, as the next three
  std::optional<StereoFeatures> global_;  // rows moved to the stamp
  std::optional<RolledPair> newest_;      // of the map, with its velocity since the pair's motion is known
  std::optional<LocalMap> map_;           // with this velocity
  RotationHypothesis rotation_;
  std::optional<MotionScene> scene_;
  MotionHypothesis found_;
};

}  // namespace sdvo
