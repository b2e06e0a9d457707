#include "stereo_descriptor_vo/places/pose_graph.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>

namespace sdvo {
namespace {

using EdgesOf = std::map<int, std::vector<const GraphEdge*>>;

/// The edges of each node, without breaks.
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

/// Shortest path to a node: its length, m, and its last edge.
struct PathTo {
  double length = std::numeric_limits<double>::infinity();
  const GraphEdge* last = nullptr;
};

/// Shortest paths from a node without breaks (Dijkstra's algorithm). Ends at the first node for which done(id, length)
/// is true: all paths that are not longer are final.
template <class Done>
std::map<int, PathTo> shortestPaths(const std::vector<GraphEdge>& edges, int from, const Done& done) {
  EdgesOf edges_of = edgesOf(edges);
  std::map<int, PathTo> paths;
  using Open = std::pair<double, int>;
  std::priority_queue<Open, std::vector<Open>, std::greater<Open>> open;
  paths[from].length = 0.0;
  open.push({0.0, from});
  while (!open.empty() && !done(open.top().second, open.top().first)) {
    const auto [length, id] = open.top();
    open.pop();
    if (length > paths[id].length) continue;
    for (const GraphEdge* edge : edges_of[id]) {
      PathTo& next = paths[otherEnd(*edge, id)];
      if (length + edge->length >= next.length) continue;
      next = {length + edge->length, edge};
      open.push({next.length, otherEnd(*edge, id)});
    }
  }
  return paths;
}

}  // namespace

PoseGraph::PoseGraph() {
  requirePoseGraphSolver();
}

PoseGraph::PoseGraph(std::map<int, Eigen::Isometry3d> nodes, std::vector<GraphEdge> edges)
    : nodes_(std::move(nodes)), edges_(std::move(edges)) {
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
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const int last_fixed = held_.value_or(nodes_.begin()->first);
  std::set<int> moved = near(edge.to, kAny);
  if (moved.count(edge.from) == 0) {
    // The loop joins two parts of the graph: that without fixed nodes moves to the other one.
    Eigen::Isometry3d T_moved = T_map_from * edge.T_from_to * T_map_to.inverse();
    if (*moved.begin() <= last_fixed) {
      const std::set<int> others = near(edge.from, kAny);
      if (*others.begin() <= last_fixed) {
        removeEdges([&](const GraphEdge& e) { return e.kind == GraphEdge::Kind::kLoop && e.to > last_fixed; });
        moved = near(edge.to, kAny);
      } else {
        moved = others;
        T_moved = T_moved.inverse();
      }
    }
    for (const int id : moved) nodes_[id] = orthonormalised(T_moved * nodes_[id]);
    ++moved_parts_;
  }
  edges_.push_back(edge);
}

void PoseGraph::passLoopsOn(int id) {
  const auto next = std::find_if(edges_.begin(), edges_.end(), [id](const GraphEdge& e) {
    return e.from == id && e.kind == GraphEdge::Kind::kOdometry;
  });
  if (next == edges_.end()) return;
  std::vector<GraphEdge> passed;
  for (const GraphEdge& edge : edges_) {
    if (edge.kind != GraphEdge::Kind::kLoop) continue;
    if (edge.to == next->to) return;
    if (edge.to != id) continue;
    GraphEdge loop = edge;
    loop.to = next->to;
    loop.T_from_to = edge.T_from_to * next->T_from_to;
    loop.covariance = carried(next->T_from_to.inverse(), edge.covariance) + next->covariance;
    loop.length += next->length, loop.turn += next->turn;
    passed.push_back(loop);
  }
  edges_.insert(edges_.end(), passed.begin(), passed.end());
}

void PoseGraph::remove(int id) {
  nodes_.erase(id);
  removeEdges([id](const GraphEdge& e) { return e.from == id || e.to == id; });
}

template <class IsGone>
void PoseGraph::removeEdges(const IsGone& is_gone) {
  edges_.erase(std::remove_if(edges_.begin(), edges_.end(), is_gone), edges_.end());
}

PoseGraph::Summary PoseGraph::optimise() {
  // If most loops contradict the odometry, its edges are given more of the largest drift.
  constexpr double kMoreSlack = 3.2;  // half a power of ten
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
  constexpr double kDriftOfRotation = 0.01 * CV_PI / 180.0;  // rad/m
  constexpr double kDriftOfTranslation = 0.03;               // m/m
  const double rotation = kDriftOfRotation * length + kDriftOfTurn * turn;
  const double translation = kDriftOfTranslation * length + 0.5 * rotation * length;
  return isotropic(translation * translation, rotation * rotation);
}

/// Covariance of an edge in the optimisation: its own, a share of the drift, and at least 1 mm and 0.1 mrad.
Matrix6d PoseGraph::covariance(const GraphEdge& edge) const {
  return edge.covariance + slack_ * slack_ * drift(edge.length, edge.turn) + isotropic(1e-6, 1e-8);
}

/// Whether most loops have a residual below the scale of their robust loss.
bool PoseGraph::loopsHold() const {
  int all = 0, hold = 0;
  for (const GraphEdge& edge : edges_) {
    if (edge.kind != GraphEdge::Kind::kLoop) continue;
    ++all;
    hold += residual(edge) <= kLoopThreshold;
  }
  return 2 * hold > all;
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
  for (const auto& [node, path] : shortestPaths(edges_, id, [&](int, double length) { return length > longest; }))
    if (path.length <= longest) found.insert(node);
  return found;
}

GraphPath PoseGraph::path(int from, int to) const {
  const std::map<int, PathTo> paths = shortestPaths(edges_, from, [&](int id, double) { return id == to; });
  GraphPath path;
  path.known = paths.count(to) > 0;
  if (!path.known) return path;
  path.length = paths.at(to).length;
  // From the end backwards: the covariance of the relative pose from a node to the end.
  Eigen::Isometry3d T_node_end = Eigen::Isometry3d::Identity();
  for (int id = to; id != from;) {
    const GraphEdge& edge = *paths.at(id).last;
    const bool forward = edge.to == id;
    const Matrix6d step = forward ? edge.covariance : carried(edge.T_from_to, edge.covariance);  // of the inverse
    path.covariance += carried(T_node_end.inverse(), step);
    path.turn += edge.turn;
    T_node_end = (forward ? edge.T_from_to : edge.T_from_to.inverse()) * T_node_end;
    id = forward ? edge.from : edge.to;
  }
  return path;
}

double PoseGraph::residual(const GraphEdge& edge) const {
  const Vector6d error = logSE3(edge.T_from_to.inverse() * nodes_.at(edge.from).inverse() * nodes_.at(edge.to));
  return std::sqrt(mahalanobisSquare(error, covariance(edge)));
}

int PoseGraph::loops() const {
  return static_cast<int>(
      std::count_if(edges_.begin(), edges_.end(), [](const GraphEdge& e) { return e.kind == GraphEdge::Kind::kLoop; }));
}

}  // namespace sdvo
