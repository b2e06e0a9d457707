#pragma once

#include <Eigen/Core>
#include <vector>

#include "drive_path.hpp"

namespace sdvo::render {

/// The road's centre line in the ground plan: what the street is built along.
class RoadLine {
 public:
  struct Sample {
    double x, z;      ///< plan position of the camera's way, m
    double height;    ///< y of the ground beneath, m (y points down)
    double heading;   ///< rad from +z towards +x
    double distance;  ///< along the way, m; negative before the first pose
  };

  /// Samples every metre below the poses, extended straight at both ends so that there is something to drive towards.
  /// Where the way comes by again at another height, the ground is the lower one, with a smooth transition.
  RoadLine(const DrivePath& path, double camera_height);

  const std::vector<Sample>& samples() const { return samples_; }
  /// Interpolated, clamped to the ends.
  Sample at(double distance) const;
  /// Plan point `lateral` metres to the right of the way.
  Eigen::Vector2d beside(double distance, double lateral) const;

 private:
  std::vector<Sample> samples_;
};

/// Ground height and distance to the road on a grid around the way.
class GroundMap {
 public:
  static constexpr double kReach = 84.0;      ///< how far from the way there is ground, m
  static constexpr double kRoadOffset = 0.9;  ///< the road's middle lies this far left of the way (drive right), m
  static constexpr double kRoadHalfWidth = 4.3;

  /// What is known of a place.
  struct Node {
    float height = 0.0f;   ///< y, m
    float path = 1e6f;     ///< distance to the nearest part of the way, m
    float road = 1e6f;     ///< distance to the nearest part of the road's middle line, m
    float lateral = 0.0f;  ///< signed distance to the way, right positive, m
    float along = 0.0f;    ///< distance along the way of the nearest part, m
  };

  explicit GroundMap(const RoadLine& road);

  struct Place : Node {
    Eigen::Vector2f road_gradient = Eigen::Vector2f::Zero();  ///< of `road` along x and z
    bool mixed = false;  ///< different parts of the way meet here: `lateral` and `along` jump
  };

  /// Bilinear; far from the way `path` and `road` are large.
  Place at(double x, double z) const;
  double height(double x, double z) const { return at(x, z).height; }
  double roadDistance(double x, double z) const { return at(x, z).road; }

  double cell() const { return kCell; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  const Node& node(int row, int column) const { return nodes_[static_cast<std::size_t>(row) * columns_ + column]; }
  Eigen::Vector2d position(int row, int column) const {
    return {origin_.x() + column * kCell, origin_.y() + row * kCell};
  }

 private:
  static constexpr double kCell = 1.5;

  Node& node(int row, int column) { return nodes_[static_cast<std::size_t>(row) * columns_ + column]; }
  void stamp(const RoadLine& road);
  void smoothHeights();

  Eigen::Vector2d origin_;
  int columns_ = 0, rows_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace sdvo::render
