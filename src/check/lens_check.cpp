#include "lens_check.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {
namespace {

using Lens = Eigen::Vector4d;  ///< focal length less one, principal point, offset of the disparities, in focal lengths

/// Normal equations of the lens from one pair after elimination of its motion, and the back substitution of the motion.
struct PairEquations {
  Eigen::Matrix4d information;
  Lens gradient;
  Vector6d motion;                         ///< at an unchanged lens: rotation, then translation in baselines
  Eigen::Matrix<double, 6, 4> per_change;  ///< the step is motion - per_change * (change of the lens)
};

template <class Rays>
PairEquations linearise(const Rays& rays, const Lens& lens, const Eigen::Isometry3d& T_previous_current) {
  constexpr double kLeastScale = 1e-4;  // rad (chosen): less than any tracker's error
  const double f = 1.0 + lens[0];
  const Eigen::Vector2d centre = lens.segment<2>(1);
  const Eigen::Matrix3d R = T_previous_current.linear();
  const Eigen::Vector3d t = T_previous_current.translation();  // in baselines
  std::vector<Eigen::Vector2d> residuals;
  std::vector<Eigen::Matrix<double, 2, 10>> jacobians;
  std::vector<double> norms;
  for (const auto& ray : rays) {
    const double disparity = ray.disparity + lens[3];
    Eigen::Vector3d turned(ray.now.x() - centre.x(), ray.now.y() - centre.y(), f);
    turned = R * turned;
    const Eigen::Vector3d point = turned + disparity * t;
    const Eigen::Vector2d seen = point.head<2>() / point.z();
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << f / point.z() * Eigen::Matrix2d::Identity(), -f / point.z() * seen;
    Eigen::Matrix<double, 2, 10> jacobian;  // of motion and lens
    jacobian << -by_point * skew(turned), by_point * disparity, by_point * R.col(2) + seen,
        Eigen::Matrix2d::Identity() - by_point * R.leftCols<2>(), by_point * t;
    jacobians.push_back(jacobian);
    residuals.push_back(ray.before - f * seen - centre);
    norms.push_back(residuals.back().norm());
  }
  std::vector<double> sorted = norms;
  const double scale = std::max(1.5 * median(sorted), kLeastScale);
  Eigen::Matrix<double, 10, 10> square = Eigen::Matrix<double, 10, 10>::Zero();
  Eigen::Matrix<double, 10, 1> product = Eigen::Matrix<double, 10, 1>::Zero();
  for (std::size_t i = 0; i < norms.size(); ++i) {
    const double weight = 1.0 / (1.0 + norms[i] * norms[i] / (scale * scale));  // Cauchy
    square += weight * jacobians[i].transpose() * jacobians[i];
    product += weight * jacobians[i].transpose() * residuals[i];
  }
  constexpr double kSteady = 1e-12;  // keeps the motion solvable where all is far away
  square.topLeftCorner<6, 6>().diagonal().array() += kSteady;
  const Eigen::LDLT<Matrix6d> motion(square.topLeftCorner<6, 6>());
  PairEquations equations;
  equations.per_change = motion.solve(square.topRightCorner<6, 4>());
  equations.motion = motion.solve(product.head<6>());
  equations.information = square.bottomRightCorner<4, 4>() - square.bottomLeftCorner<4, 6>() * equations.per_change;
  equations.gradient = product.tail<4>() - square.bottomLeftCorner<4, 6>() * equations.motion;
  return equations;
}

}  // namespace

/// Follows far corners, too, which the rows' block search leaves out: they show rotations best.
void LensCheck::add(const StereoCamera& camera, const CornerPair& pair) {
  constexpr float kRow = 1.5F, kFar = -1.0F;  // px (chosen)
  constexpr int kLevels = 4;
  const std::vector<cv::Point2f>& corners = pair.corners;
  std::vector<cv::Point2f> beside, earlier;
  const auto is_beside = trackBothWays(pair.left, pair.right, corners, beside, kLevels);
  const auto is_earlier = trackBothWays(pair.left, pair.before, corners, earlier, kLevels);
  std::vector<Track> tracks;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const cv::Point2f apart = corners[i] - beside[i];
    if (!is_beside[i] || !is_earlier[i] || std::abs(apart.y) > kRow || apart.x < kFar) continue;
    tracks.push_back({corners[i].x, corners[i].y, apart.x, earlier[i].x, earlier[i].y});
  }
  add(camera, tracks);
}

void LensCheck::add(const StereoCamera& camera, const std::vector<Track>& tracks) {
  constexpr std::size_t kFewest = 20, kMost = 300;  // tracks of a pair; pairs, a minute of them
  if (tracks.size() < kFewest || pairs_.size() >= kMost) return;
  if (!camera_.isLike(camera)) pairs_.clear();  // an autofocus changes it with each pair
  camera_ = camera;
  std::vector<Ray> rays;
  for (const Track& track : tracks)
    rays.push_back({{(track.u - camera.cx) / camera.fx, (track.v - camera.cy) / camera.fy},
                    {(track.u_before - camera.cx) / camera.fx, (track.v_before - camera.cy) / camera.fy},
                    track.disparity / camera.fx});
  std::vector<double> moved;
  for (const Ray& ray : rays) moved.push_back((ray.now - ray.before).norm());
  constexpr double kMoved = 0.002;  // focal lengths (chosen): a camera that stands shows nothing of its lens
  if (median(moved) > kMoved) pairs_.push_back(std::move(rays));
}

/// Gauss-Newton, motions alone at first.
std::optional<LensCheck::Estimate> LensCheck::estimate() const {
  constexpr std::size_t kFewest = 15, kBlock = 5;  // pairs; those that may see the same points, a second of them
  constexpr int kMotionsAlone = 6, kPasses = 18;
  constexpr double kLargest = 0.2;  // of the focal length in one step
  if (pairs_.size() < kFewest) return std::nullopt;
  std::vector<Eigen::Isometry3d> motions(pairs_.size(), Eigen::Isometry3d::Identity());
  Lens lens = Lens::Zero();
  Eigen::Matrix4d inverse, spread;
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<PairEquations> all;
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    Lens gradient = Lens::Zero(), block = Lens::Zero();
    spread.setZero();
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      all.push_back(linearise(pairs_[k], lens, motions[k]));
      information += all[k].information;
      gradient += all[k].gradient;
      block += all[k].gradient;
      if ((k + 1) % kBlock != 0 && k + 1 != pairs_.size()) continue;
      spread += block * block.transpose();
      block.setZero();
    }
    inverse = information.ldlt().solve(Eigen::Matrix4d::Identity());
    Lens change = pass < kMotionsAlone ? Lens(Lens::Zero()) : Lens(inverse * gradient);
    change *= std::min(1.0, kLargest / std::max(change.head<3>().norm(), kLargest));
    lens += change;
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      const Vector6d step = all[k].motion - all[k].per_change * change;
      motions[k].linear() = expSO3(step.head<3>()) * motions[k].linear();
      motions[k].translation() += step.tail<3>();
    }
  }
  constexpr double kPoint = 1e-3;  // rad
  const Eigen::Matrix4d covariance = inverse * spread * inverse;
  const Estimate estimate{lens.head<3>(), covariance.diagonal().head<3>().cwiseSqrt(),
                          kPoint * inverse.diagonal().head<3>().cwiseSqrt()};
  if (!estimate.value.allFinite() || !estimate.sigma.allFinite() || !estimate.resolution.allFinite())
    return std::nullopt;
  return estimate;
}

Finding LensCheck::judge() const {
  // RMS error over good calibrations of KITTI, Karlsruhe, EuRoC and three small rigs: residual distortion.
  const Eigen::Vector3d rigs(0.015, 0.03, 0.03);
  constexpr double kResolved = 0.06, kResolvedCentre = 0.1, kProved = 3.0;  // chosen; the last one: standard deviations
  const auto estimate = this->estimate();
  if (!estimate || estimate->resolution[0] > kResolved)
    return {Verdict::kOpen, "too few turns for a focal length from the images", "turn and tilt the camera"};
  const Eigen::Vector3d sigma = (estimate->sigma.cwiseAbs2() + rigs.cwiseAbs2()).cwiseSqrt();
  std::string what = text(2, "calibration by the images: focal length ", 1.0 + estimate->value[0], " +- ", sigma[0],
                          " of camera_info's");
  bool is_wrong = std::abs(estimate->value[0]) > kProved * sigma[0];
  for (const int axis : {1, 2}) {
    if (estimate->resolution[axis] > kResolvedCentre) continue;
    const double f = axis == 1 ? camera_.fx : camera_.fy;
    what +=
        text(0, axis == 1 ? ", cx off by " : ", cy off by ", f * estimate->value[axis], " +- ", f * sigma[axis], " px");
    is_wrong |= std::abs(estimate->value[axis]) > kProved * sigma[axis];
  }
  if (is_wrong)
    return {Verdict::kWarn, what,
            "is camera_info of another image size, or are the images a crop or an enlargement? Calibrate as they are"};
  return {Verdict::kOk, what};
}

}  // namespace sdvo
