#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "drive_path.hpp"
#include "ground_map.hpp"
#include "mesh.hpp"

namespace sdvo::render {

constexpr int kCarModels = 3;  ///< saloon, estate, van

/// A car whose frame has x to its right, y down and z ahead, the origin on the ground beneath its middle.
/// `paint` runs from 0 (black) to 1 (white); `seed` varies the details.
Mesh makeCar(int model, double paint, std::uint64_t seed);

/// T_world_car on the ground, turned towards `ahead`, inclined with the `slope` (any vector along the ground).
Eigen::Isometry3d placeCar(const Eigen::Vector3d& ground, const Eigen::Vector3d& ahead, const Eigen::Vector3d& slope);

/// The moving cars of a drive: one in front and a stream of oncoming ones.
class Traffic {
 public:
  struct Car {
    int model;                      ///< index into models()
    Eigen::Isometry3d T_world_car;  ///< now
    int id;                         ///< the same at all times
  };

  /// No traffic.
  Traffic() = default;
  /// The density grows from 0; the share of pixels that move grows with it.
  Traffic(const DrivePath& path, const RoadLine& road, const GroundMap& ground, double density, std::uint64_t seed);

  const std::vector<Mesh>& models() const { return models_; }
  /// The cars near the camera at `time`, seconds since the trajectory's first pose.
  std::vector<Car> at(double time) const;
  /// Where one car is at `time`, near the camera or not.
  Eigen::Isometry3d poseOf(int id, double time) const;

 private:
  double distanceOf(int id, double time) const;
  bool isOnRoad(double distance) const;  ///< with both axles

  const DrivePath* path_ = nullptr;
  const RoadLine* road_ = nullptr;
  const GroundMap* ground_ = nullptr;
  std::vector<Mesh> models_;
  double gap_ = 0.0;      ///< to the car in front, m; 0: there is none
  double spacing_ = 0.0;  ///< of the oncoming cars, m
  int oncoming_ = 0;
  double begin_ = 0.0;  ///< of the road, m
};

}  // namespace sdvo::render
