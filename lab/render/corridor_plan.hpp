#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace sdvo::render {

/// Ground plan of an endless corridor: straight stretches at right angles, to the right and to the left in turn. Path
/// and walls follow from the same plan.
class CorridorPlan {
 public:
  static constexpr double kWidth = 2.0;  ///< between the walls, m

  explicit CorridorPlan(std::uint64_t seed);

  /// Where the middle line bends, (x, z) in metres; corner 0 is behind the first pose, which is at (0, 0) and looks
  /// along z to corner 1.
  Eigen::Vector2d corner(int i) const;
  /// +1 when the corridor turns right at corner `i` ≥ 1, else -1.
  int turn(int i) const { return i % 2 == 1 ? first_turn_ : -first_turn_; }
  /// Unit vector from corner `i` to the next.
  Eigen::Vector2d direction(int i) const;
  /// From corner `i` to the next, m.
  double length(int i) const;

 private:
  std::uint64_t seed_;
  int first_turn_;
};

}  // namespace sdvo::render
