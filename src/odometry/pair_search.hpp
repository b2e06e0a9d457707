#pragma once

#include <optional>
#include <vector>

#include "../belief/motion_search.hpp"
#include "../map/reacquisition.hpp"
#include "../map/window_optimizer.hpp"
#include "odometry_state.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/motion_guess.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// Searches and adjustment with the odometry's options. They remember nothing of a pair.
struct OdometryTools {
  explicit OdometryTools(const VisualOdometryOptions& options)
      : motions(options.motion), places(options.motion), revisit(options.motion), optimizer({options.noise}) {}

  MotionSearch motions;  ///< near a prediction
  Reacquisition places;  ///< after an outage
  Revisit revisit;       ///< of key frames that left the map
  WindowOptimizer optimizer;
};

/// Log-odds that a motion is not the camera's, above which it is doubtful.
double largestDoubt(const TrackingOptions& tracking);

/// A pair and its motion since the map's newest pair. The motion is searched in the map's camera, without repeated
/// rows, with the right image rotated back and synchronous, all rows of one moment. Refers to the state and to itself.
struct SearchedPair {
  enum Kind {
    kNoMap,        ///< no map of its camera: it begins one
    kInterrupted,  ///< its pose in the map is unknown: it is looked for in all maps
    kFrozen,       ///< its images repeat although the camera moved: nothing is searched
    kContinues,    ///< the pair before has a pose in the map: the motion is searched near the expected one
  };

  /// Searches the motion; the state does not change. State and features must outlive the pair.
  SearchedPair(const VisualOdometryOptions& options, const OdometryTools& tools, const OdometryState& state,
               const StereoFeatures& given, const std::optional<MotionGuess>& guess);
  SearchedPair(const SearchedPair&) = delete;
  SearchedPair& operator=(const SearchedPair&) = delete;

  Kind kind = kNoMap;
  double dt = 0.0;                           ///< since the previous pair, s
  StereoCamera camera;                       ///< of its pixels: as camera_info says, else that of the pair before
  bool refutes_camera_info = false;          ///< the images show that a change of camera_info is wrong
  double log_odds_of_frozen = kUnsuspected;  ///< that its images repeat although the camera moved
  bool repeats_a_part = false;               ///< some rows repeat those of the previous pair

  StereoFeatures whole;            ///< all features in the map's pixels
  std::vector<int> given_indices;  ///< among the caller's features, of each below: those that repeat are left out
  StereoFeatures rotated_back;     ///< without the right camera's learnt rotation
  StereoFeatures features;         ///< of one moment, too: both views and all rows. The motion is found with these

  RotationHypothesis rotation;       ///< a new one of the right camera, which is compensated if it is likely
  std::optional<RolledPair> rolled;  ///< the pair before its rows were moved to the stamp; only with a rolling shutter
  /// Copy of the map, with its newest pair's rows moved by the velocity that this pair's motion shows.
  std::optional<LocalMap> unrolled_map;
  /// Where the motion is searched, with references to the maps of the state; none for a first pair or a frozen one.
  std::optional<MotionScene> scene;
  bool in_fallback_map = false;  ///< the scene is of the fallback map
  bool in_earlier_map = false;   ///< the scene is of the map from before a restart
  MotionHypothesis found;

  /// From the reference of the motion, s. There must be a scene, and its map must not have changed.
  double sinceReference() const { return scene->map.secondsUntil(features); }
};

}  // namespace sdvo
