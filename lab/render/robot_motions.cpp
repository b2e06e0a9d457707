#include "robot_motions.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "camera_pose.hpp"
#include "corridor_plan.hpp"
#include "plan_motion.hpp"
#include "random.hpp"
#include "wobble.hpp"

namespace sdvo::render {

namespace {

constexpr double kDegree = M_PI / 180.0;

/// 0 at the start, 1 after two seconds; two derivatives are continuous.
double fadeIn(double time) {
  const double s = std::clamp(time / 2.0, 0.0, 1.0);
  return s * s * s * (10.0 - s * (15.0 - 6.0 * s));
}

/// Into (-pi, pi].
double wrapped(double angle) {
  return std::remainder(angle, 2.0 * M_PI);
}

/// A plan motion that is planned as far as somebody looks.
class PlannedMotion {
 public:
  virtual ~PlannedMotion() = default;
  PlanMotion::State at(double time) {
    while (planned_until_ <= time) planned_until_ = planOn(planned_until_);
    return motion_.at(time);
  }

 protected:
  /// Adds what happens from `time` on and returns until when.
  virtual double planOn(double time) = 0;
  PlanMotion motion_;

 private:
  double planned_until_ = 0.0;
};

/// Walks on and on, and turns to another place of a room of 5 x 4 m every few seconds.
class Walk : public PlannedMotion {
 public:
  static constexpr double kSpeed = 0.9;          // m/s
  static constexpr double kTurn = 85 * kDegree;  // rad/s; tremor and steps take the rest of 100 deg/s
  explicit Walk(std::uint64_t seed) : random_(seed, 81) {
    constexpr double kForever = 1e7;  // s
    motion_.advance({0.5, kSpeed, 0.8, kForever});
  }

 private:
  double planOn(double time) override {
    if (time == 0.0) return 1.5;
    const PlanMotion::State now = motion_.at(time);
    const double x = random_.uniform(-2.5, 2.5), z = random_.uniform(-0.5, 3.5);
    const double angle = wrapped(std::atan2(x - now.x, z - now.z) - now.heading);
    const SpeedPulse turn = SpeedPulse::covering(angle, kTurn, 0.35, time);
    motion_.turn(turn);
    return turn.end() + random_.uniform(0.3, 1.5);
  }
  Random random_;
};

/// Stretches and turns on the spot, one after the other.
class Roundabout : public PlannedMotion {
 public:
  static constexpr double kSpeed = 0.5, kTurn = 1.0;  // m/s, rad/s
  explicit Roundabout(std::uint64_t seed) : random_(seed, 82) {}

 private:
  double planOn(double time) override {
    constexpr double kPause = 0.15, kRadius = 1.6;  // s, m
    const PlanMotion::State now = motion_.at(time);
    // The first stretch leads ahead; later ones lead to where there is room.
    double angle = 0.0, way = 0.0;
    do {
      way = random_.uniform(0.3, 0.9);
      angle = time == 0.0 ? 0.0 : random_.uniform(40.0, 180.0) * kDegree * (random_.chance(0.5) ? 1.0 : -1.0);
    } while (std::hypot(now.x + way * std::sin(now.heading + angle), now.z + way * std::cos(now.heading + angle)) >
             kRadius);
    const SpeedPulse turn = SpeedPulse::covering(angle, kTurn, 0.35, time + kPause);
    const SpeedPulse stretch = SpeedPulse::covering(way, kSpeed, 0.4, turn.end() + kPause);
    motion_.turn(turn);
    motion_.advance(stretch);
    return stretch.end();
  }
  Random random_;
};

/// Follows a corridor's middle line, its corners cut.
class CorridorWalk : public PlannedMotion {
 public:
  static constexpr double kSpeed = 0.8, kTurn = 0.8;  // m/s, rad/s
  explicit CorridorWalk(std::uint64_t seed) : plan_(seed) {
    constexpr double kForever = 1e7;  // s
    motion_.advance({0.0, kSpeed, kStart, kForever});
    const SpeedPulse corner = cornerAt(2.0 * kStart, 1);
    PlanMotion turn;
    turn.advance({0.0, kSpeed, kStart, kForever});
    turn.turn(corner);
    // A turn by a right angle goes as far ahead as aside: to the corner on the one line and from it on the other.
    corner_length_ = turn.at(corner.end()).z - kSpeed * (corner.begin - 0.5 * kStart);
    corner_time_ = corner.length;
  }

 private:
  static constexpr double kStart = 1.0;  // until it has its speed, s

  static SpeedPulse cornerAt(double time, int side) { return SpeedPulse::covering(side * M_PI_2, kTurn, 0.5, time); }

  double planOn(double time) override {
    const int corner = corner_++;
    const double way = corner == 1 ? plan_.corner(1).y() + 0.5 * kStart * kSpeed - corner_length_  // from rest
                                   : plan_.length(corner - 1) - 2.0 * corner_length_;
    const double begin = time + way / kSpeed;
    motion_.turn(cornerAt(begin, plan_.turn(corner)));
    return begin + corner_time_;
  }

  CorridorPlan plan_;
  int corner_ = 1;
  double corner_length_, corner_time_;
};

}  // namespace

Motion handHeld(std::uint64_t seed) {
  Random random(seed, 83);
  const Wobble shift_x(random, 3.0, 7.0), shift_y(random, 3.0, 7.0), shift_z(random, 3.0, 7.0), yaw(random, 3.0, 8.0),
      pitch(random, 3.0, 8.0), roll(random, 3.0, 8.0), look(random, 0.05, 0.2);
  const auto walk = std::make_shared<Walk>(seed);
  return [=](double time) {
    constexpr double kSteps = 2.0 * M_PI * 1.8;                // rad/s
    constexpr double kShift = 0.0008, kTremor = 0.001;         // m, rad
    constexpr double kBob = 0.02, kSway = 0.015, kNod = 0.01;  // m, m, rad
    const PlanMotion::State state = walk->at(time);
    const double fade = fadeIn(time), step = kSteps * time;
    const double sideways = fade * (kSway * std::sin(0.5 * step) + kShift * shift_x(time));
    const double ahead = fade * kShift * shift_z(time);
    const double heading = state.heading;
    return cameraPose(state.x + sideways * std::cos(heading) + ahead * std::sin(heading),
                      fade * (kBob * std::cos(step) + kShift * shift_y(time)),
                      state.z - sideways * std::sin(heading) + ahead * std::cos(heading),
                      heading + fade * kTremor * yaw(time),
                      fade * (kNod * std::sin(step) + 0.05 * look(time) + kTremor * pitch(time)),
                      fade * (kNod * std::cos(0.5 * step) + kTremor * roll(time)));
  };
}

Motion turnInPlace(std::uint64_t seed) {
  Random random(seed, 84);
  const Wobble bounce(random, 2.0, 8.0), nod(random, 2.0, 8.0), sway(random, 2.0, 8.0);
  const auto drive = std::make_shared<Roundabout>(seed);
  return [=](double time) {
    constexpr double kAhead = 0.1;  // of the axle, m
    const PlanMotion::State state = drive->at(time);
    // The floor shakes it as fast as it moves; squares have no kinks.
    const double pace = std::pow(state.speed / Roundabout::kSpeed, 2) + std::pow(state.rate / Roundabout::kTurn, 2);
    return cameraPose(state.x + kAhead * std::sin(state.heading), 0.0005 * pace * bounce(time),
                      state.z + kAhead * (std::cos(state.heading) - 1.0), state.heading, 0.002 * pace * nod(time),
                      0.002 * pace * sway(time));
  };
}

Motion alongCorridor(std::uint64_t seed) {
  Random random(seed, 85);
  const Wobble bounce(random, 2.0, 8.0), nod(random, 2.0, 8.0), sway(random, 2.0, 8.0);
  const auto drive = std::make_shared<CorridorWalk>(seed);
  return [=](double time) {
    const PlanMotion::State state = drive->at(time);
    const double pace = std::pow(state.speed / CorridorWalk::kSpeed, 2);
    return cameraPose(state.x, 0.0005 * pace * bounce(time), state.z, state.heading, 0.002 * pace * nod(time),
                      0.002 * pace * sway(time));
  };
}

Motion overDesk(std::uint64_t seed) {
  Random random(seed, 86);
  const Wobble x(random, 0.05, 0.35), y(random, 0.05, 0.35), z(random, 0.05, 0.35), yaw(random, 0.05, 0.3),
      pitch(random, 0.05, 0.3), roll(random, 0.05, 0.3), tremor_x(random, 3.0, 8.0), tremor_y(random, 3.0, 8.0),
      tremor_yaw(random, 3.0, 8.0), tremor_pitch(random, 3.0, 8.0);
  return [=](double time) {
    constexpr double kShift = 0.0005, kTremor = 0.001;  // m, rad
    const double fade = fadeIn(time);
    return cameraPose(fade * (0.08 * x(time) + kShift * tremor_x(time)),
                      fade * (0.02 * y(time) + kShift * tremor_y(time)), fade * 0.04 * z(time),
                      fade * (0.14 * yaw(time) + kTremor * tremor_yaw(time)),
                      fade * (0.05 * pitch(time) + kTremor * tremor_pitch(time)), fade * 0.05 * roll(time));
  };
}

}  // namespace sdvo::render
