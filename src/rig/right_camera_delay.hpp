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

namespace sdvo {

/// Log-likelihood ratio of the rows: right images late by `delay`, s, against synchronous. Their variance is unknown.
/// Each part of the image counts as one observation, because its errors are correlated. `row_error`, px: standard
/// deviation of a row in the left image.
double logRatioOfDelay(const std::vector<RowMotion>& rows, double delay, double row_error);

/// Delay of right images against left ones, from rows, and its effect on features. `known`, s: the delay beyond the
/// difference of the stamps (StereoFeatures::right_delay), as it is estimated.
class RightCameraDelay {
 public:
  RightCameraDelay();

  /// Updates the evidence that right images are those of the previous or next pair, `dt` s apart. `row_error`, px:
  /// standard deviation of a row in the left image.
  void updateOtherPair(const std::vector<RowMotion>& rows, double dt, double row_error);

  /// Adds a pair before compensation, with the camera's mean velocity (its own frame, m/s and rad/s) over the `dt` s
  /// before it.
  void learn(const StereoFeatures& features, double dt, const Vector6d& velocity, double known, bool is_confirmed);
  /// The next pair does not continue the last one.
  void interrupt() { pairs_.clear(); }

  std::optional<RowDelay::Estimate> estimate() const { return rows_.estimate(); }

  /// The pair that the right images seem to belong to.
  struct OtherPair {
    double delay;     ///< s
    double log_odds;  ///< that they belong to it
    std::string words() const;
  };
  /// The likeliest one, for pairs `dt` s apart.
  OtherPair otherPair(double dt) const;

  /// The features as the right camera would see them at the time of the left image. `velocity`: mean over the `dt` s
  /// before the pair.
  StereoFeatures synchronised(const StereoFeatures& features, double dt, const Vector6d& velocity, double known) const;

 private:
  struct Pair {
    StereoFeatures features;
    Vector6d velocity;  ///< mean over the interval before it
  };

  RowDelay rows_;
  std::deque<Pair> pairs_;  ///< the last ones
  /// Log-odds that the right image is that of the previous, or of the next pair.
  double log_odds_earlier_ = kUnsuspected, log_odds_later_ = kUnsuspected;
};

}  // namespace sdvo
