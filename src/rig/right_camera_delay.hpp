#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "../belief/motion_hypotheses.hpp"
#include "row_delay.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/rig/calibration_filter.hpp"

namespace sdvo {

/// A point that agrees with the motion.
struct RowMotion {
  double velocity;  ///< down in the left image, px/s
  double dv;        ///< v_right - v_left beyond what is usual at its place, px
  int part;         ///< of the image (RowDelay::cellOf)
};

/// The time by which the right image is taken later than the left one, and what it does to the features. Estimated is
/// what the difference of their stamps, which the features name, leaves. A turn shifts all disparities of such a rig by
/// f * rate * delay: 1 px for 3 ms at 100 deg/s and f = 212 px.
class RightCameraDelay {
 public:
  explicit RightCameraDelay(const CalibrationOptions& options = {});

  /// Evidence of a pair `dt` s after the one before for a right image that is another pair's. `row_error`, px: standard
  /// deviation of a row in the left image.
  void watch(const std::vector<RowMotion>& rows, double dt, double row_error);

  /// Takes in a pair, as taken, with the camera's mean velocity (its own frame, m/s and rad/s) over the `dt` s before
  /// it. The last pairs are forgotten once their right images are likely those of other pairs.
  void learn(const StereoFeatures& features, double dt, const Vector6d& velocity, bool is_confirmed);
  /// The next pair does not continue the last one.
  void interrupt() { pairs_.clear(); }

  std::optional<RowDelay::Estimate> estimate() const { return rows_.estimate(); }
  /// s: the prior, and as much of the estimate's distance from it as chance does not explain.
  double compensated() const;

  /// The pair that the right images seem to belong to.
  struct OtherPair {
    double delay;     ///< s
    double log_odds;  ///< that it is so
    std::string words() const;
  };
  /// The likeliest one of a stream with a pair every `dt` s.
  OtherPair otherPair(double dt) const;

  /// Standard deviation, m, of a motion over `distance` m at `rate` rad/s, by what prior and pairs leave unknown of the
  /// delay. Rigs that have the prior's delay and those that are out of step are a mixture. `features`: the pair's.
  double deviation(const StereoFeatures& features, double distance, double rate) const;

  /// The same of the position, m, from all turns: what was compensated in each against what is known now. Zero while
  /// nothing is compensated.
  double drift() const;
  /// The position is known anew.
  void forgetDrift() { exposed_ = compensated_ = 0.0; }

  /// The features as the right camera would have seen them at the left one's moment. `velocity`: the mean over the
  /// `dt` s before the pair.
  StereoFeatures synchronised(const StereoFeatures& features, double dt, const Vector6d& velocity) const;

 private:
  struct Pair {
    StereoFeatures features;  ///< their positions alone
    Vector6d velocity;        ///< over the time before it
  };
  /// The delay as a mixture: of rigs that have the prior's, and of those that are out of step.
  struct Posterior {
    double out_of_step;  ///< probability
    double mean, sigma;  ///< s, if it is
    double error(double exposed, double prior, double compensated) const;
  };
  Posterior posterior() const;
  void addRows(double dt);

  double prior_, prior_sigma_;  ///< s
  RowDelay rows_;
  RowDelay newer_, older_;  ///< as they were some tens of pairs ago
  int taught_ = 0;          ///< pairs
  std::deque<Pair> pairs_;  ///< the last ones
  /// Log-odds of a right image that is the pair's before or after.
  double earlier_ = kUnsuspected, later_ = kUnsuspected;
  /// m/s: distance times relative error of the depth for each second of delay. m: the same as it was compensated.
  double exposed_ = 0.0, compensated_ = 0.0;
};

}  // namespace sdvo
