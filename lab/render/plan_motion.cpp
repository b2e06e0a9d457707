#include "plan_motion.hpp"

#include <algorithm>
#include <cmath>

namespace sdvo::render {

SpeedPulse SpeedPulse::covering(double way, double speed, double ramp, double begin) {
  const double length = std::max(2.0 * ramp, std::abs(way) / speed + ramp);
  return {begin, way / (length - ramp), ramp, length};
}

double SpeedPulse::speed(double time) const {
  const double s = std::clamp(std::min(time - begin, end() - time) / ramp, 0.0, 1.0);
  return height * s * s * (3.0 - 2.0 * s);
}

double SpeedPulse::way(double time) const {
  // The integral of s² (3 - 2 s) is s³ (1 - s / 2), a half at s = 1.
  const auto ramped = [&](double since) {
    const double s = std::clamp(since / ramp, 0.0, 1.0);
    return ramp * s * s * s * (1.0 - 0.5 * s);
  };
  const double plateau = std::clamp(time - begin - ramp, 0.0, length - 2.0 * ramp);
  return height * (ramped(time - begin) + plateau + 0.5 * ramp - ramped(end() - time));
}

PlanMotion::State PlanMotion::at(double time) {
  while (kStep * static_cast<double>(positions_.size() - 1) <= std::max(0.0, time)) {  // Simpson's rule
    const double begin = kStep * static_cast<double>(positions_.size() - 1);
    positions_.push_back(positions_.back() +
                         kStep / 6.0 *
                             (velocity(begin) + 4.0 * velocity(begin + 0.5 * kStep) + velocity(begin + kStep)));
  }
  // Right before a step the quotient may be rounded up to it.
  const auto i = std::min(static_cast<std::size_t>(std::max(0.0, time) / kStep), positions_.size() - 2);
  const double begin = kStep * static_cast<double>(i), s = (time - begin) / kStep;
  // Hermite's cubic through both ends and velocities.
  const Eigen::Vector2d position =
      (1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s) * positions_[i] + s * s * (3.0 - 2.0 * s) * positions_.at(i + 1) +
      kStep * (s * (1.0 - s) * (1.0 - s) * velocity(begin) - s * s * (1.0 - s) * velocity(begin + kStep));
  State state{position.x(), position.y(), heading(time), 0.0, 0.0};
  for (const SpeedPulse& pulse : advances_) state.speed += pulse.speed(time);
  for (const SpeedPulse& pulse : turns_) state.rate += pulse.speed(time);
  return state;
}

void PlanMotion::add(const SpeedPulse& pulse, std::vector<SpeedPulse>& pulses) {
  pulses.push_back(pulse);
  const auto unchanged = 1 + static_cast<std::size_t>(pulse.begin / kStep);
  if (positions_.size() > unchanged) positions_.resize(unchanged);
}

double PlanMotion::heading(double time) const {
  double sum = 0.0;
  for (const SpeedPulse& pulse : turns_) sum += pulse.way(time);
  return sum;
}

Eigen::Vector2d PlanMotion::velocity(double time) const {
  double speed = 0.0;
  for (const SpeedPulse& pulse : advances_) speed += pulse.speed(time);
  const double direction = heading(time);
  return speed * Eigen::Vector2d(std::sin(direction), std::cos(direction));
}

}  // namespace sdvo::render
