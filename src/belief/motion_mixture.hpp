#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// Posterior of the camera's motion: either the one that the odometry reports is right, or one of the alternatives.
/// These are rival motions in view, places that look alike, and faults that would mislead it.
class MotionMixture {
 public:
  struct Alternative {
    double log_odds;    ///< against the motion that is reported
    Matrix6d moment;    ///< second moment of that motion's error if this is right, m and rad
    std::string cause;  ///< in words
  };

  void add(Alternative alternative) { alternatives_.push_back(std::move(alternative)); }

  /// That the motion is the camera's.
  double probability() const { return std::exp(-largest()) / total(); }
  /// That an alternative of these log-odds is right.
  double probability(double log_odds) const { return std::exp(log_odds - largest()) / total(); }

  /// Second moment of the motion's error, m and rad.
  Matrix6d moment() const {
    Matrix6d sum = Matrix6d::Zero();
    for (const Alternative& alternative : alternatives_) sum += probability(alternative.log_odds) * alternative.moment;
    return sum;
  }

  /// Of the likeliest alternative; empty without one.
  std::string cause() const { return alternatives_.empty() ? "" : likeliest().cause; }
  /// The likeliest of at least one alternative.
  const Alternative& likeliest() const {
    return *std::max_element(alternatives_.begin(), alternatives_.end(),
                             [](const auto& a, const auto& b) { return a.log_odds < b.log_odds; });
  }

 private:
  /// Largest log-odds; the motion has 0. Relative to it no sum overflows.
  double largest() const { return alternatives_.empty() ? 0.0 : std::max(likeliest().log_odds, 0.0); }
  double total() const {
    double sum = std::exp(-largest());
    for (const Alternative& alternative : alternatives_) sum += std::exp(alternative.log_odds - largest());
    return sum;
  }

  std::vector<Alternative> alternatives_;
};

}  // namespace sdvo
