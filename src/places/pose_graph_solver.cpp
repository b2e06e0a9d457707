#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>
#include <map>

#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace sdvo {
namespace {

/// Residual of an edge, as a right perturbation, in standard deviations. Rotations of odometry are corrected by a
/// relative error that all edges share.
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
    // On average over the path, the translation is rotated by half of the error at its end.
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

/// Prior of a number: zero with a standard deviation.
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

}  // namespace

void requirePoseGraphSolver() {}

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
        edge.kind == GraphEdge::Kind::kLoop ? new ceres::CauchyLoss(kLoopThreshold) : nullptr, from.q.coeffs().data(),
        from.t.data(), to.q.coeffs().data(), to.t.data(), &turn_error_);
  }
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<NearZero, 1, 1>(new NearZero{kDriftOfTurn}), nullptr,
                           &turn_error_);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 50;    // more would delay the next key frame
  options.function_tolerance = 1e-4;  // further steps are smaller than the loops' standard deviations
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary solved;
  ceres::Solve(options, &problem, &solved);

  summary.converged = solved.termination_type == ceres::CONVERGENCE;
  summary.time += solved.total_time_in_seconds;
  if (!solved.IsSolutionUsable()) return;
  for (auto& [id, T] : nodes_) {
    if (id <= last_held) continue;
    const NodePose& pose = poses.at(id);
    T.linear() = pose.q.normalized().toRotationMatrix();
    T.translation() = pose.t;
  }
}

}  // namespace sdvo
