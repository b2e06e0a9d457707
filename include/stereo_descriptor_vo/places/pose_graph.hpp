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
    kLoop,      ///< to a place that was recognised
    kBreak,     ///< between neighbours in time, but the motion is unknown
  };
  int from = 0, to = 0;
  Kind kind = Kind::kOdometry;
  Eigen::Isometry3d T_from_to = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Identity();  ///< of its right perturbation, without drift, m and rad
  double length = 0.0;  ///< distance travelled between the nodes, m; zero for a loop as it was found
  double turn = 0.0;    ///< sum of the rotation angles between them, rad; zero for a loop as it was found
};

/// The shortest path between two nodes.
struct GraphPath {
  bool known = false;                      ///< false if every path has a break
  double length = 0.0;                     ///< m
  double turn = 0.0;                       ///< sum of the rotation angles, rad
  Matrix6d covariance = Matrix6d::Zero();  ///< of a right perturbation of the relative pose
};

/// Throws std::runtime_error if the package was built without Ceres, which optimises graphs.
void requirePoseGraphSolver();

/// Poses of key frames in a map, constrained by odometry and by loops. It can be copied: an optimisation may work on a
/// copy while the original grows.
class PoseGraph {
 public:
  PoseGraph();

  /// A stored graph. Throws std::invalid_argument if an end of an edge is no node, or a covariance is not positive
  /// definite.
  PoseGraph(std::map<int, Eigen::Isometry3d> nodes, std::vector<GraphEdge> edges);

  /// Adds the first node, which is fixed.
  void start(int id, const Eigen::Isometry3d& T_map_node);

  /// Fixes all nodes up to this one: nothing moves them any more.
  void hold(int last) { held_ = last; }

  /// Adds the node `edge.to` at its pose relative to `edge.from`, which the graph has.
  void extend(const GraphEdge& edge);

  /// Adds a loop between nodes of the graph. If all paths between them have breaks, the part of the graph around
  /// `edge.to` is moved rigidly, so that the loop's residual is zero. If the first node or a held one is in that part,
  /// the other part moves. If both have held ones, the newest recognition counts: loops to nodes that are not held go.
  void close(const GraphEdge& edge);

  /// Lets the loops to a node lead on to the next one by the odometry between them. So the path from a recognised place
  /// outlives the node. Nothing changes if the next one has loops of its own.
  void passLoopsOn(int id);

  /// Removes a node and its edges. After the first node its successor is the fixed one.
  void remove(int id);

  /// Least squares over the edges (Levenberg-Marquardt over SE(3), sparse Cholesky, by Ceres). Loops that disagree with
  /// the rest have little weight (Cauchy's loss). turnError() is estimated as well. Edges of odometry are allowed a
  /// tenth of the largest drift. While most loops still disagree, this share grows, up to all of it.
  struct Summary {
    bool converged = false;
    double time = 0.0;  ///< s
  };
  Summary optimise();

  /// Takes over the poses of an optimised copy. Nodes that were added since then keep their pose relative to their
  /// predecessor. Returns false and changes nothing if close() has moved a part of the graph since the copy.
  bool adopt(const PoseGraph& optimised);

  GraphPath path(int from, int to) const;

  /// The nodes to which a path without a break, of at most `longest` m, leads; this one among them.
  std::set<int> near(int id, double longest) const;

  /// Covariance with the largest drift on a path of `length` m and `turn` rad as its standard deviation (chosen: 3 % of
  /// the way, 0.01 deg/m, 1 % of turns). Errors of the rig's calibration add up along a path instead of averaging out,
  /// and the odometry's covariance does not contain them.
  Matrix6d drift(double length, double turn) const;

  /// Residual of an edge at the present poses, in standard deviations (the root of its chi-square of six).
  double residual(const GraphEdge& edge) const;

  const std::map<int, Eigen::Isometry3d>& nodes() const { return nodes_; }
  const std::vector<GraphEdge>& edges() const { return edges_; }
  int loops() const;

  /// Relative error of all rotations of the odometry, such as a wrong focal length causes; positive: they are measured
  /// too small. Zero before there are loops.
  double turnError() const { return turn_error_; }

 private:
  template <class IsGone>
  void removeEdges(const IsGone& is_gone);
  Matrix6d covariance(const GraphEdge& edge) const;
  void solve(Summary& summary);
  bool loopsHold() const;

  static constexpr double kDriftOfTurn = 0.01;   ///< rad/rad, largest error of turns
  static constexpr double kLoopThreshold = 3.0;  ///< scale of Cauchy's loss on loops, standard deviations (chosen)

  std::map<int, Eigen::Isometry3d> nodes_;  ///< T_map_node
  std::vector<GraphEdge> edges_;
  int moved_parts_ = 0;  ///< how often close() moved a part of the graph
  std::optional<int> held_;
  double turn_error_ = 0.0;
  double slack_ = 0.1;  ///< share of drift() in the standard deviation of odometry's edges
};

}  // namespace sdvo
