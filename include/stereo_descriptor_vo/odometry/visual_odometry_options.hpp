#pragma once

#include "stereo_descriptor_vo/belief/motion_prior.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/map/floor.hpp"
#include "stereo_descriptor_vo/map/local_map.hpp"
#include "stereo_descriptor_vo/map/window_optimizer.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"
#include "stereo_descriptor_vo/matching/patch_alignment.hpp"
#include "stereo_descriptor_vo/motion/motion_estimator.hpp"
#include "stereo_descriptor_vo/rig/calibration_filter.hpp"

namespace sdvo {

struct TrackingOptions : MotionPriorOptions {
  int max_predicted_pairs = 1;
  double max_guessed = 10.0;
  double probability = 0.95;
  double doubtful_deviation = 0.05;

  void describe(OptionList& list) {
    list.add("max_predicted_pairs", max_predicted_pairs, {0, 100}, "",
             "pairs in a row whose motion may be predicted before the odometry is lost");
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
  NoiseOptions noise;
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
    list.group("noise", noise);
    list.group("matcher", matcher);
    list.group("motion", motion);
    list.group("alignment", alignment);
    list.group("map", map);
    list.group("calibration", calibration);
    list.group("tracking", tracking);
  }

  /// All steps assume the same noise.
  VisualOdometryOptions withOneNoise() const {
    VisualOdometryOptions options = *this;
    options.motion.assume(noise);
    options.alignment.noise = options.map.noise = options.window.noise = noise;
    return options;
  }
};

}  // namespace sdvo
