#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// A measured relative pose between two nodes.
struct GraphEdge {
  enum class Kind {
    kOdometry,  ///< between neighbours in time
    kLoop,      ///< of a place that was recognised
    kBreak,     ///< between neighbours in time, but the motion is unknown
  };
  int from = 0, to = 0;
  Kind kind = Kind::kOdometry;
  Eigen::Isometry3d T_from_to = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Identity();  ///< of its right perturbation, without drift, m and rad
  double length = 0.0;                         ///< of the way between, m; zero for a loop
  double turn = 0.0;                           ///< sum of all turns on it, rad; zero for a loop
};

/// What the edges between two nodes say of their relative pose.
struct GraphPath {
  bool known = false;                      ///< false where every way between them leads over a break
  double length = 0.0;                     ///< m, of the shortest one
  double turn = 0.0;                       ///< sum of its turns, rad
  Matrix6d covariance = Matrix6d::Zero();  ///< of a right perturbation of the relative pose, along that one
};

/// Throws std::runtime_error where the package was built without Ceres: a graph could then grow, but not be optimised.
void requirePoseGraphSolver();

/// Poses of key frames in a map, held together by odometry and by loops. A value: an optimisation may work on a copy
/// while the original grows.
class PoseGraph {
 public:
  PoseGraph();

  /// A graph as it was before. Throws std::invalid_argument where an edge names no node, or its covariance is none.
  PoseGraph(std::map<int, Eigen::Isometry3d> nodes, std::vector<GraphEdge> edges);

  /// The first node, which stays where it is.
  void start(int id, const Eigen::Isometry3d& T_map_node);

  /// The nodes up to this one stay where they are in every optimisation.
  void hold(int last) { held_ = last; }

  /// A new node `edge.to`, placed by its edge from one that is there.
  void extend(const GraphEdge& edge);

  /// A loop between nodes that are there. Where nothing else than breaks tied its two ends, the part of the graph that
  /// holds `edge.to` moves as a whole, so that the loop holds.
  void close(const GraphEdge& edge);

  /// Forgets a node and its edges; the node that follows stays where it is if this was the first one.
  void remove(int id);

  /// Moves all nodes but the first so that the edges agree best (Levenberg-Marquardt over SE(3), sparse Cholesky, by
  /// Ceres). Loops that disagree with the rest count little (Cauchy's loss).
  /// What the odometry gets wrong of every turn alike is estimated, too. Beyond that its edges are as stiff as the
  /// loops allow: they give way by a small share of the largest drift, and by more where loops disagree with that.
  struct Summary {
    bool converged = false;
    int iterations = 0;
    double initial_cost = 0.0, final_cost = 0.0;
    double time = 0.0;  ///< s
  };
  Summary optimise();

  /// Takes the poses of an optimised copy over; nodes that were added since then follow their neighbours. False, and
  /// nothing changes, for a copy from before a part of the graph moved as a whole.
  bool adopt(const PoseGraph& optimised);

  GraphPath path(int from, int to) const;

  /// The nodes, this one among them, that are not farther away (m) on the shortest way that leads over no break.
  std::set<int> near(int id, double longest) const;

  /// What is wrong with a rig adds up along the way instead of averaging out, and the odometry's covariance does not
  /// know. The covariance of that at its largest, for a way of so many m that turned by so many rad.
  Matrix6d drift(double length, double turn) const;

  /// Residual of an edge at the present poses, in standard deviations (the root of its chi-square of six).
  double residual(const GraphEdge& edge) const;

  const std::map<int, Eigen::Isometry3d>& nodes() const { return nodes_; }
  const std::vector<GraphEdge>& edges() const { return edges_; }
  int loops() const;

  /// The share by which the odometry measures all turns too small, as a focal length that is wrong makes it do; zero
  /// before there are loops.
  double turnError() const { return turn_error_; }

 private:
  Matrix6d covariance(const GraphEdge& edge) const;
  void solve(Summary& summary);
  bool loopsHold() const;

  static constexpr double kDriftOfTurn = 0.01;   ///< rad/rad, largest error of turns
  static constexpr double kLoopThreshold = 3.0;  ///< standard deviations; a loop's residual beyond counts less and less

  std::map<int, Eigen::Isometry3d> nodes_;  ///< T_map_node
  std::vector<GraphEdge> edges_;
  int moved_parts_ = 0;
  std::optional<int> held_;
  double turn_error_ = 0.0;
  double slack_ = 0.1;  ///< share of the largest drift that edges give way by
};

}  // namespace sdvo
