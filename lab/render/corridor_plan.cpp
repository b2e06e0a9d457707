#include "corridor_plan.hpp"

#include "random.hpp"

namespace sdvo::render {

namespace {

constexpr double kBehind = 4.0;  // m

}  // namespace

CorridorPlan::CorridorPlan(std::uint64_t seed) : seed_(seed), first_turn_(Random(seed, 90).chance(0.5) ? 1 : -1) {}

Eigen::Vector2d CorridorPlan::corner(int i) const {
  Eigen::Vector2d at(0.0, -kBehind);
  for (int before = 0; before < i; ++before) at += length(before) * direction(before);
  return at;
}

Eigen::Vector2d CorridorPlan::direction(int i) const {
  if (i % 2 == 0) return {0.0, 1.0};
  return {static_cast<double>(first_turn_), 0.0};
}

double CorridorPlan::length(int i) const {
  return Random(seed_, 91 + static_cast<std::uint64_t>(i)).uniform(7.0, 11.0) + (i == 0 ? kBehind : 0.0);
}

}  // namespace sdvo::render
