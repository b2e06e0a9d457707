#pragma once

#include <Eigen/Core>
#include <vector>

namespace sdvo::render {

/// A speed that rises smoothly from 0, stays and falls to 0 again. Its derivative, the acceleration, has no jumps.
struct SpeedPulse {
  double begin;   ///< s
  double height;  ///< the speed between the ramps, m/s or rad/s
  double ramp;    ///< how long it rises, and falls; s
  double length;  ///< of the whole pulse, at least two ramps; s

  /// The pulse that covers `way` (m or rad, of either sign) with at most `speed`.
  static SpeedPulse covering(double way, double speed, double ramp, double begin);

  double end() const { return begin + length; }
  double speed(double time) const;
  /// Way covered until `time`.
  double way(double time) const;
};

/// A motion in the ground plan by its speed ahead and its rate of turn, both sums of pulses: that of a wheeled robot,
/// or of somebody who walks. It starts at x = z = 0 and looks along z.
class PlanMotion {
 public:
  struct State {
    double x, z;         ///< m
    double heading;      ///< rad, from +z towards +x
    double speed, rate;  ///< m/s and rad/s
  };

  /// Pulses begin at 0 s or later.
  void advance(const SpeedPulse& pulse) { add(pulse, advances_); }
  void turn(const SpeedPulse& pulse) { add(pulse, turns_); }

  State at(double time);

 private:
  static constexpr double kStep = 0.002;  // s

  void add(const SpeedPulse& pulse, std::vector<SpeedPulse>& pulses);
  double heading(double time) const;
  Eigen::Vector2d velocity(double time) const;

  std::vector<SpeedPulse> advances_, turns_;
  std::vector<Eigen::Vector2d> positions_ = {Eigen::Vector2d::Zero()};  // x and z, every kStep
};

}  // namespace sdvo::render
