#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_set>

#include "ground_map.hpp"
#include "mesh.hpp"

namespace sdvo::render {

/// Where a street is built: the road, the ground, what stands there so far and which places it takes. Every builder
/// asks first whether its place is free of all parts of the way. Plan points are (x, z), metres.
class BuildingSite {
 public:
  /// Local axes of the street at a place: ahead along the way, right of it; unit, level.
  struct Axes {
    Eigen::Vector3d ahead, right;
  };

  /// All of these must outlive the site; what is built is added to `mesh`.
  BuildingSite(const RoadLine& road, const GroundMap& ground, Mesh& mesh)
      : road_(&road), ground_(&ground), mesh_(&mesh) {}

  const RoadLine& road() const { return *road_; }
  const GroundMap& ground() const { return *ground_; }
  Mesh& mesh() const { return *mesh_; }

  /// Distances along the way between which there is a road, m.
  double start() const { return road_->samples().front().distance; }
  double end() const { return road_->samples().back().distance; }

  Axes axesAt(double distance) const;
  Eigen::Vector3d onGround(const Eigen::Vector2d& p) const;

  /// Free of the road by `clearance` metres beyond its edge, within the ground, and not built on.
  bool isFree(const Eigen::Vector2d& p, double clearance) const;
  /// The same for a rectangle, given by its centre and the halves of its edges, sampled every metre.
  bool isFree(const Eigen::Vector2d& centre, const Eigen::Vector3d& half_a, const Eigen::Vector3d& half_b,
              double clearance) const;
  /// What is taken is not free any more, by whole square metres.
  void take(const Eigen::Vector2d& p);
  void take(const Eigen::Vector2d& centre, const Eigen::Vector3d& half_a, const Eigen::Vector3d& half_b);

 private:
  const RoadLine* road_;
  const GroundMap* ground_;
  Mesh* mesh_;
  std::unordered_set<std::int64_t> taken_;  // square metres of the plan
};

}  // namespace sdvo::render
