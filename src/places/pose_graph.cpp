#include "stereo_descriptor_vo/places/pose_graph.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <queue>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace sdvo {
namespace {

/// Where two nodes are, as their edge does not want it: residual of its right perturbation in standard deviations. What
/// odometry measured of turns is taken for too small by a share that is common to all edges.
class EdgeResidual {
 public:
  EdgeResidual(const GraphEdge& edge, const Matrix6d& covariance)
      : q_(edge.T_from_to.linear()),
        t_(edge.T_from_to.translation()),
        turn_(edge.kind == GraphEdge::Kind::kOdometry ? logSO3(edge.T_from_to.linear()) : Eigen::Vector3d::Zero()),
        // L L^T = covariance: L^-1 makes unit variances.
        whitening_(covariance.llt().matrixL().solve(Matrix6d::Identity())) {}

  template <class T>
  bool operator()(const T* q_from, const T* t_from, const T* q_to, const T* t_to, const T* turn_error,
                  T* residual) const {
    using Quaternion = Eigen::Quaternion<T>;
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const Eigen::Map<const Quaternion> q_a(q_from), q_b(q_to);
    const Eigen::Map<const Vector3> t_a(t_from), t_b(t_to);
    // The way turns on average by half of what its end does.
    const Quaternion half = rotation<T>(turn_.cast<T>() * (T(0.5) * *turn_error));
    const Quaternion to_edge = (q_.cast<T>() * half * half).conjugate();
    Eigen::Matrix<T, 6, 1> error;
    error.template head<3>() = to_edge * (q_a.conjugate() * (t_b - t_a) - half * t_.cast<T>());
    const Quaternion turn = to_edge * (q_a.conjugate() * q_b);
    error.template tail<3>() = (turn.w() < T(0) ? T(-2) : T(2)) * turn.vec();
    Eigen::Map<Eigen::Matrix<T, 6, 1>> whitened(residual);
    whitened = whitening_.cast<T>() * error;
    return true;
  }

 private:
  template <class T>
  static Eigen::Quaternion<T> rotation(const Eigen::Matrix<T, 3, 1>& angle_axis) {
    T q[4];
    ceres::AngleAxisToQuaternion(angle_axis.data(), q);
    return {q[0], q[1], q[2], q[3]};
  }

  Eigen::Quaterniond q_;
  Eigen::Vector3d t_, turn_;
  Matrix6d whitening_;
};

/// What is known of a number beforehand: it is zero with a standard deviation.
struct NearZero {
  double sigma;

  template <class T>
  bool operator()(const T* value, T* residual) const {
    *residual = *value / T(sigma);
    return true;
  }
};

struct NodePose {
  Eigen::Quaterniond q;
  Eigen::Vector3d t;
};

void keepUnitLength(ceres::Problem& problem, double* quaternion) {
#if CERES_VERSION_MAJOR * 100 + CERES_VERSION_MINOR >= 201
  problem.SetManifold(quaternion, new ceres::EigenQuaternionManifold);
#else
  problem.SetParameterization(quaternion, new ceres::EigenQuaternionParameterization);
#endif
}

using EdgesOf = std::map<int, std::vector<const GraphEdge*>>;

/// The edges at each node, but for breaks.
EdgesOf edgesOf(const std::vector<GraphEdge>& edges) {
  EdgesOf edges_of;
  for (const GraphEdge& edge : edges) {
    if (edge.kind == GraphEdge::Kind::kBreak) continue;
    edges_of[edge.from].push_back(&edge);
    edges_of[edge.to].push_back(&edge);
  }
  return edges_of;
}

int otherEnd(const GraphEdge& edge, int id) {
  return edge.from == id ? edge.to : edge.from;
}

/// The nodes that edges other than breaks tie to one.
std::set<int> part(const std::vector<GraphEdge>& edges, int id) {
  EdgesOf edges_of = edgesOf(edges);
  std::set<int> found{id};
  std::vector<int> open{id};
  while (!open.empty()) {
    const int next = open.back();
    open.pop_back();
    for (const GraphEdge* edge : edges_of[next])
      if (found.insert(otherEnd(*edge, next)).second) open.push_back(otherEnd(*edge, next));
  }
  return found;
}

struct Way {
  double length = std::numeric_limits<double>::infinity();
  const GraphEdge* last = nullptr;
};

/// The ways from a node, not over breaks, until one is done (id, length); the shortest for all that are not longer
/// (Dijkstra's algorithm).
template <class Done>
std::map<int, Way> shortestWays(const std::vector<GraphEdge>& edges, int from, const Done& done) {
  EdgesOf edges_of = edgesOf(edges);
  std::map<int, Way> ways;
  using Open = std::pair<double, int>;
  std::priority_queue<Open, std::vector<Open>, std::greater<Open>> open;
  ways[from].length = 0.0;
  open.push({0.0, from});
  while (!open.empty() && !done(open.top().second, open.top().first)) {
    const auto [length, id] = open.top();
    open.pop();
    if (length > ways[id].length) continue;
    for (const GraphEdge* edge : edges_of[id]) {
      Way& next = ways[otherEnd(*edge, id)];
      if (length + edge->length >= next.length) continue;
      next = {length + edge->length, edge};
      open.push({next.length, otherEnd(*edge, id)});
    }
  }
  return ways;
}

/// Covariance of a right perturbation of T^-1 from that of T.
Matrix6d inverted(const Eigen::Isometry3d& T, const Matrix6d& covariance) {
  const Matrix6d ad = adjoint(T);
  return ad * covariance * ad.transpose();
}

}  // namespace

PoseGraph::PoseGraph(const PoseGraphOptions& options) : options_(checked(options)) {}

PoseGraph::PoseGraph(const PoseGraphOptions& options, std::map<int, Eigen::Isometry3d> nodes,
                     std::vector<GraphEdge> edges)
    : options_(checked(options)), nodes_(std::move(nodes)), edges_(std::move(edges)) {
  for (const GraphEdge& edge : edges_) {
    const std::string name = "edge " + std::to_string(edge.from) + " - " + std::to_string(edge.to);
    if (nodes_.count(edge.from) == 0 || nodes_.count(edge.to) == 0)
      throw std::invalid_argument(name + " has an end that is no node");
    if (!edge.covariance.allFinite() || edge.covariance.llt().info() != Eigen::Success)
      throw std::invalid_argument(name + " has no positive definite covariance");
  }
}

void PoseGraph::start(int id, const Eigen::Isometry3d& T_map_node) {
  nodes_.emplace(id, T_map_node);
}

void PoseGraph::extend(const GraphEdge& edge) {
  nodes_[edge.to] = orthonormalised(nodes_.at(edge.from) * edge.T_from_to);
  edges_.push_back(edge);
}

void PoseGraph::close(const GraphEdge& edge) {
  const Eigen::Isometry3d T_map_from = nodes_.at(edge.from), T_map_to = nodes_.at(edge.to);
  std::set<int> moved = part(edges_, edge.to);
  if (moved.count(edge.from) == 0) {
    Eigen::Isometry3d T_moved = T_map_from * edge.T_from_to * T_map_to.inverse();
    if (moved.count(nodes_.begin()->first) > 0) {
      moved = part(edges_, edge.from);
      T_moved = T_moved.inverse();
    }
    for (const int id : moved) nodes_[id] = orthonormalised(T_moved * nodes_[id]);
    ++moved_parts_;
  }
  edges_.push_back(edge);
}

void PoseGraph::remove(int id) {
  nodes_.erase(id);
  edges_.erase(
      std::remove_if(edges_.begin(), edges_.end(), [id](const GraphEdge& e) { return e.from == id || e.to == id; }),
      edges_.end());
}

PoseGraph::Summary PoseGraph::optimise() {
  constexpr double kMoreSlack = 3.2;
  Summary summary;
  if (loops() == 0) {
    summary.converged = true;
    return summary;
  }
  solve(summary);
  while (slack_ < 1.0 && !loopsHold()) {
    slack_ = std::min(1.0, kMoreSlack * slack_);
    solve(summary);
  }
  return summary;
}

Matrix6d PoseGraph::drift(double length, double turn) const {
  constexpr double kRadians = CV_PI / 180.0;
  const double rotation = options_.drift_rotation * kRadians * length + options_.drift_turn * turn;
  const double translation = options_.drift_translation * length + 0.5 * rotation * length;
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(translation * translation), Eigen::Vector3d::Constant(rotation * rotation);
  return variances.asDiagonal();
}

/// With the drift that edges give way by, and never better than to a millimetre.
Matrix6d PoseGraph::covariance(const GraphEdge& edge) const {
  Vector6d least;
  least << Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-8);
  return edge.covariance + slack_ * slack_ * drift(edge.length, edge.turn) + Matrix6d(least.asDiagonal());
}

/// Whether most loops are within the residual beyond which they count less.
bool PoseGraph::loopsHold() const {
  int all = 0, hold = 0;
  for (const GraphEdge& edge : edges_) {
    if (edge.kind != GraphEdge::Kind::kLoop) continue;
    ++all;
    hold += residual(edge) <= options_.loop_threshold;
  }
  return 2 * hold > all;
}

void PoseGraph::solve(Summary& summary) {
  std::map<int, NodePose> poses;
  for (const auto& [id, T] : nodes_) poses[id] = {Eigen::Quaterniond(T.linear()), T.translation()};

  ceres::Problem problem;
  for (auto& [id, pose] : poses) {
    problem.AddParameterBlock(pose.q.coeffs().data(), 4);
    problem.AddParameterBlock(pose.t.data(), 3);
    keepUnitLength(problem, pose.q.coeffs().data());
  }
  const int last_held = held_.value_or(poses.begin()->first);
  for (auto& [id, pose] : poses) {
    if (id > last_held) break;
    problem.SetParameterBlockConstant(pose.q.coeffs().data());
    problem.SetParameterBlockConstant(pose.t.data());
  }
  for (const GraphEdge& edge : edges_) {
    NodePose &from = poses.at(edge.from), &to = poses.at(edge.to);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<EdgeResidual, 6, 4, 3, 4, 3, 1>(new EdgeResidual(edge, covariance(edge))),
        edge.kind == GraphEdge::Kind::kLoop ? new ceres::CauchyLoss(options_.loop_threshold) : nullptr,
        from.q.coeffs().data(), from.t.data(), to.q.coeffs().data(), to.t.data(), &turn_error_);
  }
  const double sigma = std::max(options_.drift_turn, 1e-6);
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<NearZero, 1, 1>(new NearZero{sigma}), nullptr, &turn_error_);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = options_.iterations;
  options.function_tolerance = 1e-4;  // further steps move nodes by less than loops know
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary solved;
  ceres::Solve(options, &problem, &solved);

  summary.converged = solved.termination_type == ceres::CONVERGENCE;
  summary.iterations += static_cast<int>(solved.iterations.size());
  summary.initial_cost = solved.initial_cost;
  summary.final_cost = solved.final_cost;
  summary.time += solved.total_time_in_seconds;
  if (!solved.IsSolutionUsable()) return;
  for (auto& [id, T] : nodes_) {
    if (id <= last_held) continue;
    const NodePose& pose = poses.at(id);
    T.linear() = pose.q.normalized().toRotationMatrix();
    T.translation() = pose.t;
  }
}

bool PoseGraph::adopt(const PoseGraph& optimised) {
  if (optimised.moved_parts_ != moved_parts_) return false;
  slack_ = optimised.slack_;
  turn_error_ = optimised.turn_error_;
  const std::map<int, Eigen::Isometry3d> before = nodes_;
  for (auto& [id, T] : nodes_) {
    const auto better = optimised.nodes_.find(id);
    if (better != optimised.nodes_.end()) T = better->second;
  }
  for (const GraphEdge& edge : edges_) {
    if (edge.kind == GraphEdge::Kind::kLoop || optimised.nodes_.count(edge.to) > 0) continue;
    nodes_.at(edge.to) = nodes_.at(edge.from) * before.at(edge.from).inverse() * before.at(edge.to);
  }
  return true;
}

std::set<int> PoseGraph::near(int id, double longest) const {
  std::set<int> found;
  for (const auto& [node, way] : shortestWays(edges_, id, [&](int, double length) { return length > longest; }))
    if (way.length <= longest) found.insert(node);
  return found;
}

GraphPath PoseGraph::path(int from, int to) const {
  const std::map<int, Way> ways = shortestWays(edges_, from, [&](int id, double) { return id == to; });
  GraphPath path;
  path.known = ways.count(to) > 0;
  if (!path.known) return path;
  path.length = ways.at(to).length;
  // Back from the end: what is known of the way from a node on to the end.
  Eigen::Isometry3d T_node_end = Eigen::Isometry3d::Identity();
  for (int id = to; id != from;) {
    const GraphEdge& edge = *ways.at(id).last;
    const bool forward = edge.to == id;
    const Matrix6d step = forward ? edge.covariance : inverted(edge.T_from_to, edge.covariance);
    const Matrix6d ad = adjoint(T_node_end.inverse());
    path.covariance += ad * step * ad.transpose();
    path.turn += edge.turn;
    T_node_end = (forward ? edge.T_from_to : edge.T_from_to.inverse()) * T_node_end;
    id = forward ? edge.from : edge.to;
  }
  return path;
}

double PoseGraph::residual(const GraphEdge& edge) const {
  const Vector6d error = logSE3(edge.T_from_to.inverse() * nodes_.at(edge.from).inverse() * nodes_.at(edge.to));
  return std::sqrt(error.dot(covariance(edge).ldlt().solve(error)));
}

int PoseGraph::loops() const {
  return static_cast<int>(
      std::count_if(edges_.begin(), edges_.end(), [](const GraphEdge& e) { return e.kind == GraphEdge::Kind::kLoop; }));
}

}  // namespace sdvo
