#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>

namespace sdvo::render {

/// T_first_camera of a left camera at any time (s, from 0). Accelerations are continuous; it starts from rest.
using Motion = std::function<Eigen::Isometry3d(double time)>;

/// Somebody walks through a room with the camera in the hand, 0.9 m/s with 1.8 steps a second, and turns to where he
/// will go next. The camera bobs, sways and trembles; it never turns faster than 100 deg/s.
Motion handHeld(std::uint64_t seed);

/// A robot with two driven wheels: straight stretches of 0.3 to 0.9 m at up to 0.5 m/s, and turns on the spot between
/// them by 40 to 180 deg at 1 rad/s. The camera stands 0.1 m ahead of the axle. It stays within some 4 x 4 m.
Motion turnInPlace(std::uint64_t seed);

/// A robot that follows a CorridorPlan at 0.8 m/s and takes its corners at 0.8 rad/s.
Motion alongCorridor(std::uint64_t seed);

/// A camera that looks around over a desk, within some 0.35 x 0.1 x 0.2 m and ± 20 deg.
Motion overDesk(std::uint64_t seed);

}  // namespace sdvo::render
