#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

/// Probability that chance exceeds the limits of this package, for normal distributions as well as for agreement.
constexpr double kTailProbability = 1e-4;

/// Chi-square of so many degrees of freedom that is exceeded with this probability.
constexpr double noiseGate(int numbers) {
  constexpr double gates[] = {15.14, 18.42, 21.11, 23.51, 25.74, 27.86};
  return gates[numbers - 1];
}

/// Standard deviations of measurements, px, and the limits that follow from them.
struct NoiseOptions {
  double corner = 0.4;
  /// Standard deviation of a position that is aligned with the point's reference patch, px.
  static constexpr double kReference = 0.1;
  double disparity = 0.1;  ///< px, of a disparity's noise, which is new in every sighting
  double common_disparity =
      0.3;  ///< px, of the error that all disparities of one point share, until 20 windows told more of it

  void describe(OptionList& list) {
    list.add("corner", corner, {0.01, 10.0}, "px",
             "standard deviation of a detected corner's position, in each direction; times the scale that is learnt");
  }

  /// Root mean square length of (u_left, v_left, u_right) between a corner and the map's point: both err.
  double length() const { return std::sqrt(6.0 * corner * corner + common_disparity * common_disparity); }

  /// The largest such length. u_left and u_right share the corners' errors (a factor of sqrt(2)), and both corners err
  /// (another one).
  double inlierGate() const { return 2.0 * corner * std::sqrt(noiseGate(1)); }

  /// The largest distance of a corner from its point, in each direction.
  double cornerGate() const { return corner * std::sqrt(noiseGate(1)); }

  /// Standard deviation, in each direction, of a corner that no patch confirms, px. It may lie anywhere in the disc
  /// where u_left and u_right are within the gate. The disc's radius is the gate / sqrt(2); the deviation in each
  /// direction is half of that.
  double unconfirmedCorner() const { return inlierGate() / std::sqrt(8.0); }
};

enum class ConsensusMethod { kRansac, kMsac, kLoRansac, kGasac, kAdaptiveGasac };

inline const std::vector<std::string>& namesOf(ConsensusMethod) {
  static const std::vector<std::string> names = {"ransac", "msac", "lo_ransac", "gasac", "adaptive_gasac"};
  return names;
}

struct GeneticConsensusOptions {
  static constexpr int kPopulation = 24;        ///< individuals of a generation
  static constexpr double kMutationRate = 0.1;  ///< gasac: ratio of a child's genes replaced at random
  bool learning = true;                         ///< adaptive: how good a replacement each gene is
};

struct SampleConsensusOptions {
  ConsensusMethod consensus = ConsensusMethod::kMsac;
  double inlier_threshold = NoiseOptions().inlierGate();  ///< px, of (u_left, v_left, u_right)
  int max_iterations = 500;  ///< samples at most; fewer once one without outliers was drawn at 0.9999
  int seed = 1;              ///< of the random samples
  GeneticConsensusOptions genetic;

  void describe(OptionList& list) {
    list.add("consensus", consensus, "outlier rejection; adaptive_gasac is the paper's");
  }
};

struct MotionRefinementOptions {
  double kernel_scale = NoiseOptions().length();  ///< px: residual at which the Cauchy kernel has the weight 1/2
  int refinement_iterations = 20;                 ///< Levenberg-Marquardt steps at most
};

struct MotionEstimatorOptions : SampleConsensusOptions, MotionRefinementOptions {
  int min_inliers = 12;  ///< fewer are no motion (chosen)

  /// For measurements with this noise.
  void assume(const NoiseOptions& noise) { inlier_threshold = noise.inlierGate(), kernel_scale = noise.length(); }

  /// With the thresholds multiplied by `noise`.
  MotionEstimatorOptions scaled(double noise) const {
    MotionEstimatorOptions options = *this;
    options.inlier_threshold *= noise, options.kernel_scale *= noise;
    return options;
  }
};

struct LocalMapOptions {
  int keyframes = 8;
  int min_shared_points = 150;  ///< with the newest pair, of an older key frame in the map (chosen)
  int remembered_keyframes = 40;
  double keyframe_parallax = 4.0;  ///< px, median since the last key frame, from which a pair is one (chosen)
  double keyframe_overlap = 0.6;   ///< … or a smaller ratio of its points is seen in the last one (chosen)
  NoiseOptions noise;

  void describe(OptionList& list) {
    list.add("keyframes", keyframes, {2, 50}, "",
             "newest key frames, which the map holds whatever they see; as many older ones at most, because they share "
             "points with the newest pair");
    list.add("remembered_keyframes", remembered_keyframes, {0, 1000}, "",
             "key frames that are remembered beyond that, by where they were taken, for a camera that comes back");
  }
};

struct PlanarOptions {
  bool planar = false;
  double planar_height_sigma = 0.01;  ///< m, of the base over the floor (chosen)
  double planar_tilt_sigma = 0.3;     ///< deg, of roll and pitch of the base (chosen)

  void describe(OptionList& list) {
    list.add("planar", planar,
             "the base drives on a flat floor: its height, roll and pitch are constrained in the adjustment");
  }
};

struct CalibrationOptions {
  bool enabled = true;
  double prior_offset = 0.0;
  double prior_bend = 0.0;
  double prior_sigma = 1.0;
  double right_roll_sigma = 0.001;  ///< rad, chosen: 0.2 px at the upper edge of KITTI's images
  double right_delay = 0.0;
  double right_delay_sigma = 0.003;  ///< s, chosen: 0.2 ms with a common trigger (twelve drives), half a frame without
  double readout = 0.0;

  void describe(OptionList& list) {
    list.add("enabled", enabled, "estimate the rig's residual disparity error while driving and compensate it");
    list.add("prior_offset", prior_offset, {-20.0, 20.0}, "px",
             "that error in the image centre as far as it is known beforehand; held fixed when not enabled");
    list.add("prior_bend", prior_bend, {-20.0, 20.0}, "px", "the same for its change at 45 degrees from the centre");
    list.add("prior_sigma", prior_sigma, {1e-4, 10.0}, "px",
             "standard deviation of an error of both, in the centre and at 45 degrees from it, which is beforehand as "
             "likely as none");
    list.add("right_delay", right_delay, {-0.1, 0.1}, "s",
             "time by which right images are known to be later than left ones; what it lacks is estimated");
    list.add("readout", readout, {-0.1, 0.1}, "s",
             "rolling shutters: the last row is taken so much later than the first (negative: earlier), the middle one "
             "at the stamp; 0: estimated in turns");
  }
};

struct MotionPriorOptions {
  double max_speed = 70.0;
  double max_rotation_rate = 6.3;  ///< rad/s, one turn a second: a faster rotation is a wrong one (chosen)
  double acceleration = 2.2;
  double rotation_acceleration = 1.4;  ///< rad/s, of the rate of rotation within a second, as acceleration
  double stamp_sigma = 0.005;          ///< s, of a stamp's error (chosen)
  double max_gap = 1.0;

  void describe(OptionList& list) {
    list.add("max_speed", max_speed, {0.1, 1000.0}, "m/s", "a faster motion is a wrong one");
    list.add("acceleration", acceleration, {0.01, 1000.0}, "m/s",
             "standard deviation, in each direction, of the velocity's change within a second: white acceleration, so "
             "half of it in a quarter of the time");
    list.add("max_gap", max_gap, {0.01, 60.0}, "s", "longest time between pairs over which the motion is predicted");
  }
};

struct TrackingOptions : MotionPriorOptions {
  int max_predicted_pairs = 1;  ///< in a row, before the odometry is lost (chosen)
  double max_guessed = 10.0;
  double probability = 0.95;
  double doubtful_deviation = 0.05;

  void describe(OptionList& list) {
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
  MotionEstimatorOptions motion;
  LocalMapOptions map;
  CalibrationOptions calibration;
  TrackingOptions tracking;
  PlanarOptions planar;

  void describe(OptionList& list) {
    list.collect(planar);
    list.group("noise", noise);
    list.group("motion", motion);
    list.group("map", map);
    list.group("calibration", calibration);
    list.group("tracking", tracking);
  }

  /// All steps assume the same noise.
  VisualOdometryOptions withOneNoise() const {
    VisualOdometryOptions options = *this;
    options.motion.assume(noise);
    options.map.noise = noise;
    return options;
  }
};

}  // namespace sdvo
