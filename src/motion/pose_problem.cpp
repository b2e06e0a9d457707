#include "pose_problem.hpp"

#include <algorithm>
#include <cmath>

namespace sdvo {

std::optional<Eigen::Vector3d> reprojectionResidual(const StereoCamera& camera, const Eigen::Isometry3d& T,
                                                    const Correspondence& correspondence) {
  const Eigen::Vector3d point = T * correspondence.point;
  if (point.z() < camera.nearestDepth()) return std::nullopt;
  return correspondence.measurement - camera.project(point);
}

Eigen::Matrix<double, 3, 6> motionJacobian(const StereoCamera& camera, const Eigen::Isometry3d& T,
                                           const Eigen::Vector3d& point) {
  const Eigen::Vector3d moved = T * point;
  const Eigen::Matrix3d projection = camera.projectionJacobian(moved);
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << projection, -projection * skew(moved);
  return jacobian;
}

PoseCandidates PoseProblem::solve(const MinimalSample& sample) const {
  std::array<Eigen::Vector3d, 3> points, rays;
  for (std::size_t k = 0; k < sample.size(); ++k) {
    const Correspondence& c = correspondences_[sample[k]];
    points[k] = c.point;
    rays[k] = Eigen::Vector3d((c.measurement.x() - camera_.cx) / camera_.fx,
                              (c.measurement.y() - camera_.cy) / camera_.fy, 1.0)
                  .normalized();
  }
  return solveThreePointPose(points, rays);
}

template <class Visit>
void PoseProblem::visitSquares(const Eigen::Isometry3d& T, const Visit& visit) const {
  constexpr int kBlock = 8 * CorrespondenceArrays::kLanes;  // few enough to stop early
  std::array<double, kBlock> squares;
  for (int first = 0; first < count(); first += kBlock) {
    const int left = std::min(count() - first, kBlock);
    arrays_.squareResiduals(camera_, T, first, CorrespondenceArrays::roundedUp(left), squares.data());
    for (int k = 0; k < left; ++k)
      if (!visit(first + k, squares[k])) return;
  }
}

double PoseProblem::truncatedCost(const Eigen::Isometry3d& T, double cost_to_beat) const {
  const double limit = threshold_ * threshold_;
  double sum = 0.0;
  visitSquares(T, [&](int, double square) {
    sum += std::min(square, limit);
    return sum < cost_to_beat;
  });
  return sum;
}

double PoseProblem::outlierCost(const Eigen::Isometry3d& T, double cost_to_beat) const {
  double outliers = 0.0;
  visitSquares(T, [&](int, double square) {
    outliers += std::sqrt(square) > threshold_;
    return outliers < cost_to_beat;
  });
  return outliers;
}

std::vector<int> PoseProblem::inliers(const Eigen::Isometry3d& T, double thresholds) const {
  std::vector<int> found;
  found.reserve(correspondences_.size());
  visitSquares(T, [&](int i, double square) {
    if (std::sqrt(square) <= thresholds * threshold_) found.push_back(i);
    return true;
  });
  return found;
}

}  // namespace sdvo
