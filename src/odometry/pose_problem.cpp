#include "stereo_descriptor_vo/odometry/pose_problem.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace sdvo {
namespace {

constexpr double kNearestDepth = 0.05;  // m, in front of the camera

}  // namespace

std::optional<Eigen::Vector3d> reprojectionResidual(const StereoCamera& camera, const Eigen::Isometry3d& T,
                                                    const Correspondence& correspondence) {
  const Eigen::Vector3d point = T * correspondence.point;
  if (point.z() < kNearestDepth) return std::nullopt;
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

std::vector<Eigen::Isometry3d> PoseProblem::solve(const MinimalSample& sample) const {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (const int i : sample) {
    const Correspondence& c = correspondences_[static_cast<std::size_t>(i)];
    points.emplace_back(c.point.x(), c.point.y(), c.point.z());
    rays.emplace_back((c.measurement.x() - camera_.cx) / camera_.fx, (c.measurement.y() - camera_.cy) / camera_.fy);
  }
  std::vector<cv::Mat> rotations, translations;
  const int solutions =
      cv::solveP3P(points, rays, cv::Matx33d::eye(), cv::noArray(), rotations, translations, cv::SOLVEPNP_AP3P);
  std::vector<Eigen::Isometry3d> poses;
  for (int s = 0; s < solutions; ++s) {
    Eigen::Vector3d rotation, translation;
    cv::cv2eigen(rotations[s], rotation);
    cv::cv2eigen(translations[s], translation);
    if (!rotation.allFinite() || !translation.allFinite()) continue;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = expSO3(rotation);
    T.translation() = translation;
    poses.push_back(T);
  }
  return poses;
}

double PoseProblem::truncatedCost(const Eigen::Isometry3d& T, double score_to_beat) const {
  const double limit = threshold_ * threshold_;
  double sum = 0.0;
  for (const Correspondence& correspondence : correspondences_) {
    const auto residual = reprojectionResidual(camera_, T, correspondence);
    sum += residual ? std::min(residual->squaredNorm(), limit) : limit;
    if (sum >= score_to_beat) break;
  }
  return sum;
}

double PoseProblem::outlierCost(const Eigen::Isometry3d& T, double score_to_beat) const {
  double outliers = 0.0;
  for (const Correspondence& correspondence : correspondences_) {
    const auto residual = reprojectionResidual(camera_, T, correspondence);
    if (!residual || residual->norm() > threshold_) ++outliers;
    if (outliers >= score_to_beat) break;
  }
  return outliers;
}

std::vector<int> PoseProblem::inliers(const Eigen::Isometry3d& T, double thresholds) const {
  std::vector<int> found;
  for (int i = 0; i < count(); ++i) {
    const auto residual = reprojectionResidual(camera_, T, correspondences_[static_cast<std::size_t>(i)]);
    if (residual && residual->norm() <= thresholds * threshold_) found.push_back(i);
  }
  return found;
}

}  // namespace sdvo
