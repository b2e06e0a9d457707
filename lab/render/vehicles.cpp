#include "vehicles.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "random.hpp"

namespace sdvo::render {

namespace {

constexpr double kOncomingSpeed = 9.0;     // m/s
constexpr double kOncomingLateral = -3.3;  // m right of the camera's way
constexpr double kHalfLength = 1.3;        // m between the middle of a car and its axles
constexpr double kVisible = 120.0;         // m along the way
constexpr int kModelVariants = 9;

/// Side view of a car, from the front bumper over the roof to the rear one: (ahead, up) in metres.
struct Profile {
  std::vector<Eigen::Vector2d> outline;
  std::vector<bool> window;  ///< whether the stretch after each corner is glass
  double half_width;
};

const Profile& profile(int model) {
  static const std::array<Profile, kCarModels> profiles = {{
      {{{2.15, 0.25}, {2.2, 0.6}, {1.2, 0.9}, {0.45, 1.4}, {-0.9, 1.43}, {-1.5, 1.0}, {-2.1, 0.95}, {-2.15, 0.3}},
       {false, false, true, false, true, false, false},
       0.86},
      {{{2.1, 0.25}, {2.15, 0.65}, {1.25, 0.98}, {0.5, 1.52}, {-1.6, 1.55}, {-2.0, 1.0}, {-2.1, 0.9}, {-2.1, 0.3}},
       {false, false, true, false, true, false, false},
       0.88},
      {{{2.4, 0.3}, {2.45, 0.85}, {1.9, 1.15}, {1.35, 1.9}, {-2.2, 1.95}, {-2.35, 1.2}, {-2.4, 1.1}, {-2.4, 0.35}},
       {false, false, true, false, true, false, false},
       0.95},
  }};
  return profiles[static_cast<std::size_t>(model)];
}

}  // namespace

Mesh makeCar(int model, double paint, std::uint64_t seed) {
  using Vector3 = Eigen::Vector3d;
  Random random(seed, 50);
  const Profile& shape = profile(model);
  const double body = 0.06 + 0.9 * paint * paint, glass = 0.05;
  const auto point = [](const Eigen::Vector2d& p, double side) { return Vector3(side, -p.y(), p.x()); };
  // The cabin is narrower at the roof.
  const auto width = [&](const Eigen::Vector2d& p) { return shape.half_width - 0.22 * std::max(0.0, p.y() - 0.9); };

  Mesh car;
  const std::size_t corners = shape.outline.size();
  for (std::size_t i = 0; i + 1 < corners; ++i) {
    const Eigen::Vector2d &p = shape.outline[i], &q = shape.outline[i + 1];
    car.addQuad(point(p, -width(p)), point(p, width(p)), point(q, width(q)), point(q, -width(q)),
                shape.window[i] ? Material::kFlat : Material::kCarSide, shape.window[i] ? glass : 1.6 * body);
  }
  for (const double side : {-1.0, 1.0}) {
    for (std::size_t i = 0; i + 1 < corners; ++i) {  // flank as a row of strips down to the sill
      const Eigen::Vector2d &p = shape.outline[i], &q = shape.outline[i + 1];
      const Eigen::Vector2d low_p(p.x(), 0.28), low_q(q.x(), 0.28);
      car.addQuad(point(p, side * width(p)), point(q, side * width(q)), point(low_q, side * shape.half_width),
                  point(low_p, side * shape.half_width), Material::kCarSide, 1.6 * body);
    }
    // Side windows, door joints and handles, a hair's breadth in front of the flank.
    const Eigen::Vector2d &front = shape.outline[3], &rear = shape.outline[4];
    const double sill = 0.95;
    for (int pane = 0; pane < 2; ++pane) {
      const double from = front.x() + 0.25 + (rear.x() - front.x() - 0.2) * 0.5 * pane;
      const double to = from + (rear.x() - front.x() - 0.2) * 0.5 + 0.1;
      const Eigen::Vector2d a(from, front.y() - 0.1), b(to, front.y() - 0.1), c(to - 0.02, sill),
          d(from + (pane == 0 ? 0.35 : 0.0), sill);
      const auto out = [&](const Eigen::Vector2d& p) { return point(p, side * (width(p) + 0.03)); };
      car.addQuad(out(a), out(b), out(c), out(d), Material::kFlat, glass);
      car.addBox(point({to - 0.15, 0.86}, side * (shape.half_width + 0.02)), Vector3(0.02, 0, 0), Vector3(0, 0.015, 0),
                 Vector3(0, 0, 0.09), Material::kFlat, 0.2);
    }
    for (const double axle : {0.62, -0.62}) {
      const Vector3 hub(side * (shape.half_width - 0.08), -0.31, axle * 2.05);
      car.addTube(hub - Vector3(side * 0.1, 0, 0), hub + Vector3(side * 0.1, 0, 0), 0.31, 0.31, 14, Material::kFlat,
                  0.06);
      car.addTube(hub + Vector3(side * 0.1, 0, 0), hub + Vector3(side * 0.101, 0, 0), 0.31, 0.2, 14, Material::kFlat,
                  0.05);
      car.addTube(hub + Vector3(side * 0.101, 0, 0), hub + Vector3(side * 0.09, 0, 0), 0.2, 0.0, 14, Material::kFlat,
                  0.45);
    }
    for (const double end : {2.1, -2.1})  // lights
      car.addBox(point({end, 0.68}, side * 0.65), Vector3(0.16, 0, 0), Vector3(0, 0.08, 0), Vector3(0, 0, 0.12),
                 Material::kFlat, end > 0 ? 0.9 : 0.3);
  }
  for (const double end : {1.0, -1.0}) {
    const double nose = end > 0 ? shape.outline[0].x() : shape.outline[corners - 1].x();
    car.addPanel(Vector3(-0.26, -0.62, nose + end * 0.07), Vector3(0.52, 0, 0), Vector3(0, 0.11, 0), Material::kPoster,
                 1.0, random.uniform(0.0, 4.0), 0.3);
    car.addBox(Vector3(0, -0.4, nose + end * 0.03), Vector3(shape.half_width, 0, 0), Vector3(0, 0.09, 0),
               Vector3(0, 0, 0.03), Material::kFlat, 0.12);
  }
  // What is dark beneath: the floor closes the body.
  car.addPanel(Vector3(-shape.half_width, -0.27, -2.1), Vector3(2.0 * shape.half_width, 0, 0), Vector3(0, 0, 4.2),
               Material::kFlat, 0.03);
  return car;
}

Eigen::Isometry3d placeCar(const Eigen::Vector3d& ground, const Eigen::Vector3d& ahead, const Eigen::Vector3d& slope) {
  Eigen::Vector3d forward = ahead;
  const double run = std::hypot(slope.x(), slope.z());
  if (run > 0.0) forward.y() = slope.y() / run * std::hypot(ahead.x(), ahead.z());
  forward.normalize();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(forward).normalized();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << right, forward.cross(right), forward;
  pose.translation() = ground;
  return pose;
}

Traffic::Traffic(const DrivePath& path, const RoadLine& road, const GroundMap& ground, double density,
                 std::uint64_t seed)
    : path_(&path), road_(&road), ground_(&ground), begin_(road.samples().front().distance) {
  for (int variant = 0; variant < kModelVariants; ++variant) {
    Random random(seed, 60 + variant);
    models_.push_back(makeCar(variant % kCarModels, random.uniform(), random.bits()));
  }
  if (density <= 0.0) return;
  const double length = road.samples().back().distance - begin_;
  spacing_ = std::max(9.0, 40.0 / density);
  oncoming_ = std::max(1, static_cast<int>(length / spacing_));
  spacing_ = length / oncoming_;
  gap_ = std::max(5.0, 22.0 / std::sqrt(density));
}

double Traffic::distanceOf(int id, double time) const {
  if (id == 0) return path_->distanceAt(time) + gap_ * (1.0 + 0.12 * std::sin(0.35 * time));
  const double length = spacing_ * oncoming_;
  const double way = std::fmod(spacing_ * id - kOncomingSpeed * time, length);
  return begin_ + (way < 0.0 ? way + length : way);
}

bool Traffic::isOnRoad(double distance) const {
  return distance - kHalfLength >= begin_ && distance + kHalfLength <= road_->samples().back().distance;
}

Eigen::Isometry3d Traffic::poseOf(int id, double time) const {
  const double distance = distanceOf(id, time), direction = id == 0 ? 1.0 : -1.0;
  const double lateral = id == 0 ? 0.0 : kOncomingLateral;
  const auto ground = [&](double s) {
    const Eigen::Vector2d p = road_->beside(s, lateral);
    return Eigen::Vector3d(p.x(), ground_->height(p.x(), p.y()), p.y());
  };
  const Eigen::Vector3d slope = direction * (ground(distance + kHalfLength) - ground(distance - kHalfLength));
  return placeCar(ground(distance), slope, slope);
}

std::vector<Traffic::Car> Traffic::at(double time) const {
  std::vector<Car> cars;
  if (gap_ <= 0.0) return cars;
  const double here = path_->distanceAt(time);
  const Eigen::Vector3d camera = path_->poseAt(time).translation();
  for (int id = 0; id <= oncoming_; ++id) {
    const double distance = distanceOf(id, time);
    if (std::abs(distance - here) > kVisible || !isOnRoad(distance)) continue;
    const Car car = {id % kModelVariants, poseOf(id, time), id};
    // On a way that crosses itself an oncoming car may come along while the camera crosses its lane.
    const Eigen::Vector3d offset = car.T_world_car.translation() - camera;
    if (std::hypot(offset.x(), offset.z()) > 3.2) cars.push_back(car);
  }
  return cars;
}

}  // namespace sdvo::render
