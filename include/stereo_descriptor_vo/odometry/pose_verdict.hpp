#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

struct PoseVerdictOptions {
  double max_speed = 70.0;
  double max_rotation_rate = 6.3;
  double max_acceleration = 20.0;
  double max_rotation_acceleration = 30.0;
  double stamp_tolerance = 0.02;
  int doubtful_inliers = 40;
  double doubtful_ratio = 0.4;
  double doubtful_lasting_ratio = 0.5;
  double doubtful_deviation = 0.05;

  void describe(OptionList& list) {
    list.add("max_speed", max_speed, {0.1, 1000.0}, "m/s", "a faster motion is a wrong one");
    list.add("max_rotation_rate", max_rotation_rate, {0.1, 100.0}, "rad/s", "a faster rotation is a wrong one");
    list.add("max_acceleration", max_acceleration, {0.1, 10000.0}, "m/s^2", "a larger acceleration is doubted");
    list.add("max_rotation_acceleration", max_rotation_acceleration, {0.1, 10000.0}, "rad/s^2",
             "a larger acceleration of the rotation is doubted");
    list.add("stamp_tolerance", stamp_tolerance, {0.0, 1.0}, "s",
             "error of the time between two stamps that speeds, rates and accelerations are forgiven");
    list.add("doubtful_inliers", doubtful_inliers, {0, 10000}, "", "fewer inliers are doubted");
    list.add("doubtful_ratio", doubtful_ratio, {0.0, 1.0}, "",
             "a smaller share of inliers among the matches is doubted; a third of it is no motion");
    list.add("doubtful_lasting_ratio", doubtful_lasting_ratio, {0.0, 1.0}, "",
             "the same among the matches of points that four pairs saw");
    list.add("doubtful_deviation", doubtful_deviation, {0.001, 1000.0}, "m",
             "a way whose standard deviation is larger than this and 3 % of it is doubted");
  }
};

/// What a motion that was found rests on, and what it would mean.
struct PoseEvidence {
  int matches = 0, inliers = 0;
  int lasting_matches = 0, lasting_inliers = 0;  ///< of points that at least four pairs saw
  double distance = 0.0;                         ///< from the last key frame, m
  double deviation = 0.0;                        ///< standard, of that distance by the map's adjustment, m
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();  ///< since the last measured pair
  Matrix6d covariance = Matrix6d::Zero();                    ///< of that motion, m and rad
  double dt = 0.0;                                           ///< since the last measured pair, s
  std::optional<Vector6d> velocity;                          ///< before, m/s and rad/s; nothing when unknown
  double velocity_age = 0.0;                                 ///< of that at the last measured pair, s
  std::optional<Eigen::Isometry3d> guess;                    ///< the motion as another source than the images has it
};

/// What is to be done with a motion: use it, use it as one hypothesis among others, or not at all.
enum class Trust { kSound, kDoubtful, kNone };

struct PoseVerdict {
  Trust trust = Trust::kSound;
  std::string reason;    ///< in words, unless it is sound
  bool of_rate = false;  ///< what is doubted is only how fast that would have been
};

/// Judges a motion by what it rests on. It only looks: the motion is taken or left, never changed. Rates are judged
/// with the motion's own standard deviation and with the stamps' tolerance, so that noise over a tiny dt is no rate.
PoseVerdict judgePose(const PoseVerdictOptions& options, int min_inliers, const PoseEvidence& evidence);

/// The part of it that asks whether a camera with the velocity before could have moved so, or whether another source
/// says about the same: sound or doubtful.
PoseVerdict judgeChange(const PoseVerdictOptions& options, const PoseEvidence& evidence);

/// Fewer matches of lasting points do not tell which motion is the camera's.
inline constexpr int kEnoughLasting = 20;

/// Whether a motion is not that of the points that stood still so far.
bool lastingDisagree(const PoseVerdictOptions& options, const PoseEvidence& evidence);

/// Whether it is that of enough of them. Too few neither agree nor disagree.
bool lastingAgree(const PoseVerdictOptions& options, const PoseEvidence& evidence);

/// Whether no camera moves so, as far as the velocity before tells, and the lasting points do not confirm it either.
bool isImplausible(const PoseVerdictOptions& options, const PoseEvidence& evidence);

/// Whether no vehicle comes to this motion in the time since its velocity was known for certain, though a single pair
/// could be so fast.
bool isUnexpected(const PoseEvidence& evidence);

}  // namespace sdvo
