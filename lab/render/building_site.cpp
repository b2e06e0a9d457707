#include "building_site.hpp"

#include <cmath>

namespace sdvo::render {

namespace {

std::int64_t squareMetre(const Eigen::Vector2d& p) {
  return (static_cast<std::int64_t>(std::floor(p.x())) * (std::int64_t{1} << 32)) ^
         static_cast<std::int64_t>(static_cast<std::uint32_t>(static_cast<std::int32_t>(std::floor(p.y()))));
}

template <class Visit>
void forFootprint(const Eigen::Vector2d& centre, const Eigen::Vector3d& half_a, const Eigen::Vector3d& half_b,
                  const Visit& visit) {
  const Eigen::Vector2d plan_a(half_a.x(), half_a.z()), plan_b(half_b.x(), half_b.z());
  const int na = static_cast<int>(std::ceil(2.0 * plan_a.norm())),
            nb = static_cast<int>(std::ceil(2.0 * plan_b.norm()));
  for (int i = 0; i <= na; ++i)
    for (int j = 0; j <= nb; ++j) {
      const double a = na > 0 ? 2.0 * i / na - 1.0 : 0.0, b = nb > 0 ? 2.0 * j / nb - 1.0 : 0.0;
      visit(centre + a * plan_a + b * plan_b);
    }
}

}  // namespace

BuildingSite::Axes BuildingSite::axesAt(double distance) const {
  const double heading = road_->at(distance).heading;
  return {{std::sin(heading), 0.0, std::cos(heading)}, {std::cos(heading), 0.0, -std::sin(heading)}};
}

Eigen::Vector3d BuildingSite::onGround(const Eigen::Vector2d& p) const {
  return {p.x(), ground_->height(p.x(), p.y()), p.y()};
}

bool BuildingSite::isFree(const Eigen::Vector2d& p, double clearance) const {
  const GroundMap::Node node = ground_->at(p.x(), p.y());
  return node.road > GroundMap::kRoadHalfWidth + clearance && node.path < GroundMap::kReach - 6.0 &&
         taken_.count(squareMetre(p)) == 0;
}

bool BuildingSite::isFree(const Eigen::Vector2d& centre, const Eigen::Vector3d& half_a, const Eigen::Vector3d& half_b,
                          double clearance) const {
  bool free = true;
  forFootprint(centre, half_a, half_b, [&](const Eigen::Vector2d& p) { free = free && isFree(p, clearance); });
  return free;
}

void BuildingSite::take(const Eigen::Vector2d& p) {
  taken_.insert(squareMetre(p));
}

void BuildingSite::take(const Eigen::Vector2d& centre, const Eigen::Vector3d& half_a, const Eigen::Vector3d& half_b) {
  forFootprint(centre, half_a, half_b, [&](const Eigen::Vector2d& p) { take(p); });
}

}  // namespace sdvo::render
