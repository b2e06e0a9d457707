#include "preset_paths.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "camera_pose.hpp"
#include "random.hpp"
#include "robot_motions.hpp"
#include "wobble.hpp"

namespace sdvo::render {

namespace {

using Poses = std::vector<Eigen::Isometry3d>;

/// A closed or open line in the ground plan by its curvature, integrated in small steps.
struct PlanCurve {
  std::vector<Eigen::Vector3d> samples;  ///< x, z, heading (rad, from +z towards +x), every kStep metres
  static constexpr double kStep = 0.05;

  void run(double length, double curvature) {
    // Clothoids at both ends of an arc: nobody turns the wheel in an instant.
    const double ramp = std::min(8.0, 0.5 * length);
    const double plateau = curvature * length / (length - ramp);
    for (double at = 0.5 * kStep; at < length; at += kStep) {
      const double share = std::clamp(std::min(at, length - at) / ramp, 0.0, 1.0);
      const Eigen::Vector3d last = samples.empty() ? Eigen::Vector3d::Zero() : samples.back();
      const double heading = last.z() + kStep * (curvature == 0.0 ? 0.0 : plateau * share);
      samples.emplace_back(last.x() + kStep * std::sin(heading), last.y() + kStep * std::cos(heading), heading);
    }
  }
  double length() const { return kStep * static_cast<double>(samples.size()); }
  Eigen::Vector3d at(double distance) const {
    const double index = std::clamp(distance / kStep, 0.0, static_cast<double>(samples.size()) - 1.001);
    const auto i = static_cast<std::size_t>(index);
    return samples[i] + (index - static_cast<double>(i)) * (samples[i + 1] - samples[i]);
  }
};

/// Distance after `time` along a way of `length` with `stops` stops of 3 s, at most `speed` and 1.5 m/s² of braking.
double distanceWithStops(double time, double length, int stops, double speed) {
  constexpr double kAcceleration = 1.5, kPause = 3.0;
  const double leg = length / (stops + 1);
  const double ramp_time = speed / kAcceleration, ramp_length = 0.5 * speed * ramp_time;
  const double leg_time = 2.0 * ramp_time + (leg - 2.0 * ramp_length) / speed;
  const int whole = static_cast<int>(time / (leg_time + kPause));
  const double t = std::min(time - whole * (leg_time + kPause), leg_time);
  const double within = t < ramp_time              ? 0.5 * kAcceleration * t * t
                        : t < leg_time - ramp_time ? ramp_length + speed * (t - ramp_time)
                                                   : leg - 0.5 * kAcceleration * (leg_time - t) * (leg_time - t);
  return whole * leg + within;
}

Poses relativeToFirst(Poses poses) {
  const Eigen::Isometry3d T_first_world = poses.front().inverse();
  for (Eigen::Isometry3d& pose : poses) pose = T_first_world * pose;
  return poses;
}

/// Shrinks the way along each axis to the side of a cube, m.
void shrinkInto(double side, Poses& poses) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Isometry3d& pose : poses) box.extend(pose.translation());
  const Eigen::Array3d scale = side / box.sizes().array().max(side);
  for (Eigen::Isometry3d& pose : poses) pose.translation().array() *= scale;
}

/// How the road shakes a car.
struct CarShake {
  explicit CarShake(Random& random)
      : bounce(random, 0.8, 2.5), nod(random, 0.8, 2.5), sway(random, 0.5, 1.5), drift(random, 0.02, 0.08) {}
  Wobble bounce, nod, sway, drift;
};

Poses stillPoses(int frames) {
  return Poses(static_cast<std::size_t>(frames > 0 ? frames : 100), Eigen::Isometry3d::Identity());
}

Poses backAndForthPoses(int frames, double rate) {
  Poses poses;
  constexpr double kWay = 20.0, kPeriod = 13.0;  // m ahead, s for there and back
  constexpr int kTimes = 5;
  if (frames <= 0) frames = 1 + static_cast<int>(kTimes * kPeriod * rate);
  for (int i = 0; i < frames; ++i) {
    const double z = 0.5 * kWay * (1.0 - std::cos(2.0 * M_PI * i / (rate * kPeriod)));
    poses.push_back(cameraPose(0.3 * std::sin(M_PI * z / kWay), 0.0, z, 0.0, 0.0, 0.0));
  }
  return poses;
}

Poses hoverPoses(int frames, double rate, Random& random) {
  Poses poses;
  const Wobble x(random, 0.03, 0.15), y(random, 0.03, 0.2), z(random, 0.03, 0.15), yaw(random, 0.02, 0.1),
      pitch(random, 0.1, 0.4), roll(random, 0.1, 0.4);
  for (int i = 0; i < (frames > 0 ? frames : 400); ++i) {
    const double t = i / rate;
    poses.push_back(cameraPose(0.9 * x(t), 0.35 * y(t), 0.9 * z(t), 0.45 * yaw(t), 0.04 * pitch(t), 0.04 * roll(t)));
  }
  return relativeToFirst(std::move(poses));
}

/// straight, figure_eight or city_loop.
Poses carPoses(const std::string& name, int frames, double rate, const CarShake& shake) {
  Poses poses;
  PlanCurve curve;
  double speed = 10.0;
  int stops = 0;
  const auto addLap = [&] {
    if (name == "straight") {
      curve.run(300.0, 0.0);
    } else if (name == "figure_eight") {
      speed = 7.0;
      constexpr double kRadius = 28.0;
      curve.run(2.0 * M_PI * kRadius, 1.0 / kRadius);
      curve.run(2.0 * M_PI * kRadius, -1.0 / kRadius);
    } else {
      speed = 11.0;
      stops = 3;
      constexpr double kTurn = 14.0;  // radius of the corners, m
      for (const double side : {310.0, 210.0, 310.0, 210.0}) {
        curve.run(side, 0.0);
        curve.run(0.5 * M_PI * kTurn, 1.0 / kTurn);
      }
    }
  };
  addLap();
  const double lap = curve.length();
  const auto distanceAt = [&](double t) { return stops > 0 ? distanceWithStops(t, lap, stops, speed) : speed * t; };
  if (frames <= 0)
    for (frames = 1; distanceAt(frames / rate) < lap - 1e-6; ++frames) continue;
  while (curve.length() < distanceAt(frames / rate)) addLap();
  const double hills = name == "figure_eight" ? 2.0 : name == "straight" ? 3.0 : 1.0;  // whole ones: laps must meet
  for (int i = 0; i < frames; ++i) {
    const double t = i / rate, distance = distanceAt(t);
    // Bumps grow with the speed and vanish at a stop, where the picture has to stand still.
    const double pace = std::min(1.0, (distanceAt(t + 0.05) - distanceAt(std::max(0.0, t - 0.05))) / (0.1 * speed));
    const Eigen::Vector3d plan = curve.at(distance);
    const double phase = 2.0 * M_PI * hills * distance / lap;
    const double hill = 0.5 * (1.0 - std::cos(phase));
    const double climb = std::atan(0.5 * std::sin(phase) * 2.0 * M_PI * hills / lap);
    const double weave = name == "straight" ? 0.25 * shake.drift(t) : 0.0;
    poses.push_back(cameraPose(plan.x() + weave, hill + 0.008 * pace * shake.bounce(t), plan.y(), plan.z(),
                               -climb + 0.0025 * pace * shake.nod(t), 0.003 * pace * shake.sway(t)));
  }
  return relativeToFirst(std::move(poses));
}

/// A preset whose pose is known at any time; null for other names.
Motion robotMotion(const std::string& name, std::uint64_t seed) {
  if (name == "hand_held") return handHeld(seed);
  if (name == "turn_in_place") return turnInPlace(seed);
  if (name == "corridor") return alongCorridor(seed);
  if (name == "desk") return overDesk(seed);
  return nullptr;
}

/// Finer than the frames, so that images blurred by motion know how the motion changes within their exposure.
DrivePath sampled(const Motion& motion, int frames, double rate) {
  constexpr double kFinest = 400.0;  // Hz
  const int steps = std::max(1, static_cast<int>(std::ceil(kFinest / rate)));
  Poses poses;
  for (int i = 0; i <= ((frames > 0 ? frames : 400) - 1) * steps; ++i) poses.push_back(motion(i / (rate * steps)));
  return DrivePath(std::move(poses), rate, steps);
}

struct Preset {
  std::string name;
  std::optional<Scenery> scenery;
};

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = {{"straight", {}},
                                          {"figure_eight", {}},
                                          {"city_loop", {}},
                                          {"back_and_forth", {}},
                                          {"hover", Scenery::kRoom},
                                          {"hover_1m", Scenery::kRoom},
                                          {"still", {}},
                                          {"hand_held", Scenery::kRoom},
                                          {"turn_in_place", Scenery::kRoom},
                                          {"corridor", Scenery::kCorridor},
                                          {"desk", Scenery::kDesk}};
  return all;
}

}  // namespace

const std::vector<std::string>& presetNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const Preset& preset : presets()) result.push_back(preset.name);
    return result;
  }();
  return names;
}

std::optional<Scenery> presetScenery(const std::string& name) {
  for (const Preset& preset : presets())
    if (preset.name == name) return preset.scenery;
  return std::nullopt;
}

DrivePath makePresetPath(const std::string& name, int frames, double rate, std::uint64_t seed) {
  Random random(seed, 20);
  const CarShake shake(random);
  if (name == "still") return DrivePath(stillPoses(frames), rate);
  if (name == "back_and_forth") return DrivePath(backAndForthPoses(frames, rate), rate);
  if (name == "straight" || name == "figure_eight" || name == "city_loop")
    return DrivePath(carPoses(name, frames, rate, shake), rate);
  if (name == "hover" || name == "hover_1m") {
    Poses poses = hoverPoses(frames, rate, random);
    if (name == "hover_1m") shrinkInto(1.0, poses);
    return DrivePath(std::move(poses), rate);
  }
  if (const auto motion = robotMotion(name, seed)) return sampled(motion, frames, rate);
  throw std::invalid_argument("there is no trajectory preset '" + name + "'");
}

}  // namespace sdvo::render
