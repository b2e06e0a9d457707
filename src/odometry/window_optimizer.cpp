#include "stereo_descriptor_vo/odometry/window_optimizer.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "../common/median.hpp"
#include "log_sum.hpp"
#include "pose_blocks.hpp"

namespace sdvo {
namespace {

constexpr int kCalibration = RigCalibration::kParameters;
using CalibrationVector = RigCalibration::Vector;
using PosePoint = Eigen::Matrix<double, 6, 3>;

/// Normal equations of poses and calibration after the elimination of the points, and what is needed to get these back.
struct ReducedSystem {
  struct Point {
    Eigen::Matrix3d inverse_hessian;
    Eigen::Vector3d gradient;
    int end;  ///< of its sightings; they begin where those of the point before end
  };
  Eigen::MatrixXd hessian;  ///< poses but the first, then the calibration
  Eigen::VectorXd gradient;
  std::vector<Point> points;
  std::vector<PosePoint> pose_point;  ///< for each sighting from a pose that may move
  std::vector<int> pose;              ///< of it, from zero on
  std::vector<Eigen::Matrix<double, kCalibration, 3>> calibration_point;  ///< for each point
  std::vector<double> common_squares;                                     ///< of the points that tell, px^2
  double cost = 0.0;
  double weight = 0.0;
  double weighted_square = 0.0;
};

/// T_camera_anchor of all poses: points that one pair saw first lie next to each other and share them.
class RelativePoses {
 public:
  /// In the memory of earlier poses. These must outlive their use.
  void take(const std::vector<Eigen::Isometry3d>& T_camera_origin) {
    T_camera_origin_ = T_camera_origin.data();
    T_camera_anchor_.resize(T_camera_origin.size());
    known_.assign(T_camera_origin.size(), 0);
    T_origin_anchor_.setIdentity();
  }

  void setAnchor(const Eigen::Isometry3d& T_origin_anchor) {
    if (T_origin_anchor.matrix() == T_origin_anchor_.matrix()) return;
    T_origin_anchor_ = T_origin_anchor;
    std::fill(known_.begin(), known_.end(), 0);
  }
  const Eigen::Isometry3d& at(int frame) {
    const std::size_t f = static_cast<std::size_t>(frame);
    if (!known_[f]) T_camera_anchor_[f] = T_camera_origin_[f] * T_origin_anchor_, known_[f] = 1;
    return T_camera_anchor_[f];
  }

 private:
  const Eigen::Isometry3d* T_camera_origin_ = nullptr;
  Eigen::Isometry3d T_origin_anchor_;
  std::vector<Eigen::Isometry3d> T_camera_anchor_;
  std::vector<char> known_;
};

/// What all disparities of one point say beyond what its positions do.
class DisparitiesOfPoint {
 public:
  /// Residual and its derivatives by the point, both divided by the noise and times the root of the sighting's weight.
  void add(double root, double residual, const Eigen::RowVector3d& by_point) {
    ++count_;
    weight_ += root * root;
    residuals_ += root * residual;
    by_point_ += root * by_point;
  }

  /// Square of their mean residual as a variance: what the point itself followed of it is made up for. None where that
  /// is more than half.
  std::optional<double> commonSquare(const Eigen::Matrix3d& covariance) const {
    constexpr int kFewest = 4;
    if (count_ < kFewest) return std::nullopt;
    const double followed = by_point_.dot(covariance * by_point_.transpose()) / weight_;
    if (followed > 0.5) return std::nullopt;
    const double mean = residuals_ / weight_;
    return mean * mean / (1.0 - followed);
  }

 private:
  int count_ = 0;
  double weight_ = 0.0, residuals_ = 0.0;
  Eigen::RowVector3d by_point_ = Eigen::RowVector3d::Zero();
};

/// Median of squares as the variance of a normal distribution; none of too few. Reorders them.
std::optional<double> varianceOf(std::vector<double>& squares) {
  constexpr std::size_t kFewest = 20;
  constexpr double kMedianOfChiSquare = 0.4549;  // of one degree of freedom
  if (squares.size() < kFewest) return std::nullopt;
  return median(squares) / kMedianOfChiSquare;
}

/// A sighting of a point that is not in front of the camera costs as much as a very wrong one.
constexpr double kBehindSquare = 1e4;

/// Linear algebra of one window after the other, in the same memory.
class Solver {
 public:
  explicit Solver(const WindowOptimizerOptions& options) : options_(options) {}

  /// Refers to the window from now on: every accepted step is linearised anew.
  void take(const Window& window) {
    window_ = &window;
    common_sigma_ = window.calibration_prior.common_sigma.value_or(options_.common_disparity_sigma);
    const auto& observations = window.observations;
    first_of_point_.clear();
    for (std::size_t i = 0; i < observations.size(); ++i)
      if (i == 0 || observations[i].point != observations[i - 1].point) first_of_point_.push_back(static_cast<int>(i));
    first_of_point_.push_back(static_cast<int>(observations.size()));
    sightings_.assign(window.points.size(), 0);
    for (const WindowObservation& observation : observations) ++sightings_[static_cast<std::size_t>(observation.point)];
    inverse_noise_.clear();
    inverse_noise_.reserve(observations.size());
    for (const WindowObservation& observation : observations) inverse_noise_.push_back(inverseNoise(observation));
    poses_ = static_cast<int>(window.T_camera_origin.size()) - 1;
    size_ = 6 * poses_ + kCalibration;
  }

  int poses() const { return poses_; }
  int size() const { return size_; }

  /// Square of the residual at which the Cauchy kernel bends: a square s costs bend * log(1 + s / bend).
  double bend() const { return options_.kernel_scale * options_.kernel_scale; }

  double priorCost(const Window& window) const {
    const CalibrationVector error = window.calibration.value - window.calibration_prior.mean;
    return error.dot(window.calibration_prior.information * error);
  }

  /// Normalised residual of observation i under another estimate of poses, points and calibration; the kernel is not
  /// applied.
  bool residual(const Window& window, std::size_t i, Eigen::Vector3d& residual, ObservationJacobians* jacobians) {
    const WindowObservation& observation = window_->observations[i];
    const AnchoredPoint& point = window.points[observation.point];
    T_camera_anchor_.setAnchor(point.T_origin_anchor);
    Eigen::Vector3d prediction;
    if (!predictFromAnchor(window.camera, T_camera_anchor_.at(observation.frame), point.ray_and_inverse_depth,
                           prediction, jacobians))
      return false;
    prediction.z() += window.calibration.disparityError(window.camera, observation.measurement.x());
    residual = inverse_noise_[i].cwiseProduct(observation.measurement - prediction);
    return true;
  }

  /// Also gives the square of each observation's residual.
  double cost(const Window& window, std::vector<double>& squares) {
    LogSum costs;
    T_camera_anchor_.take(window.T_camera_origin);
    Eigen::Vector3d r;
    squares.resize(window_->observations.size());
    for (std::size_t i = 0; i < squares.size(); ++i) {
      squares[i] = residual(window, i, r, nullptr) ? r.squaredNorm() : kBehindSquare;
      costs.add(squares[i] / bend());
    }
    return priorCost(window) + bend() * costs.value();
  }

  /// In the memory that the system has of an earlier linearisation.
  void linearise(const Window& window, double damping, ReducedSystem& system) {
    system.hessian.setZero(size_, size_);
    system.gradient.setZero(size_);
    system.pose_point.resize(window.observations.size());
    system.pose.clear();
    system.pose.reserve(window.observations.size());
    system.weight = system.weighted_square = 0.0;
    const std::size_t points = first_of_point_.size() - 1;
    system.common_squares.clear();
    system.common_squares.reserve(points);
    system.points.resize(points);
    system.calibration_point.resize(points);
    const int c = 6 * poses_;
    auto calibration_hessian = system.hessian.block<kCalibration, kCalibration>(c, c);
    auto calibration_gradient = system.gradient.segment<kCalibration>(c);
    calibration_hessian += window.calibration_prior.information;
    calibration_gradient +=
        window.calibration_prior.information * (window.calibration_prior.mean - window.calibration.value);
    LogSum costs;

    T_camera_anchor_.take(window.T_camera_origin);
    of_point_.resize(window.T_camera_origin.size());
    scaled_.resize(of_point_.size());
    for (std::size_t p = 0; p < points; ++p) {
      Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
      Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
      Eigen::Matrix<double, kCalibration, 3>& calibration_point = system.calibration_point[p];
      calibration_point.setZero();
      DisparitiesOfPoint disparities;
      int seen = 0;
      for (int i = first_of_point_[p]; i < first_of_point_[p + 1]; ++i) {
        const WindowObservation& observation = window.observations[i];
        Eigen::Vector3d r;
        ObservationJacobians jacobians;
        if (!residual(window, static_cast<std::size_t>(i), r, &jacobians)) {
          costs.add(kBehindSquare / bend());
          continue;
        }
        const double square = r.squaredNorm(), weight = 1.0 / (1.0 + square / bend());
        costs.add(square / bend());
        system.weight += weight;
        system.weighted_square += weight * square;
        const double root = std::sqrt(weight);
        r *= root;
        const Eigen::Vector3d scale = root * inverse_noise_[static_cast<std::size_t>(i)];
        const Eigen::Matrix3d by_point = scale.asDiagonal() * jacobians.point;
        const RigCalibration::RowVector by_calibration =
            scale.z() * RigCalibration::shape(window.camera, observation.measurement.x());
        hessian.noalias() += by_point.transpose() * by_point;
        gradient.noalias() += by_point.transpose() * r;
        calibration_point.noalias() += by_calibration.transpose() * by_point.row(2);
        calibration_hessian.noalias() += by_calibration.transpose() * by_calibration;
        calibration_gradient.noalias() += by_calibration.transpose() * r.z();
        disparities.add(root, r.z(), by_point.row(2));
        if (observation.frame == 0) continue;
        WeightedSighting& sighting = of_point_[static_cast<std::size_t>(seen++)];
        Eigen::Map<PosePoint> by_pose(sighting.by_pose);
        by_pose = jacobians.pose.transpose() * scale.asDiagonal();
        Eigen::Map<Eigen::Matrix3d>(sighting.by_point) = by_point;
        Eigen::Map<Eigen::Vector3d>(sighting.residual) = r;
        sighting.pose = observation.frame - 1;
        system.pose.push_back(sighting.pose);
        system.hessian.block<kCalibration, 6>(c, 6 * sighting.pose).noalias() +=
            by_calibration.transpose() * by_pose.col(2).transpose();
      }

      hessian.diagonal() *= 1.0 + damping;
      hessian.diagonal().array() += 1e-9;
      const Eigen::Matrix3d inverse = hessian.inverse();
      const int end = static_cast<int>(system.pose.size());
      system.points[p] = {inverse, gradient, end};
      const double sigma = 1.0 / inverse_noise_[static_cast<std::size_t>(first_of_point_[p])].z();
      if (const auto square = disparities.commonSquare(inverse))
        system.common_squares.push_back(sigma * sigma * *square);
      const PointProducts products{inverse.data(), gradient.data(), system.pose_point[0].data() + 18 * (end - seen),
                                   scaled_[0].data()};
      addEliminatedPoint(of_point_.data(), seen, products, system.hessian.data(), size_, system.gradient.data());
      for (int k = 0; k < seen; ++k)
        system.hessian.block<kCalibration, 6>(c, 6 * of_point_[k].pose).noalias() -=
            calibration_point * scaled_[k].transpose();
      calibration_hessian.noalias() -= calibration_point * inverse * calibration_point.transpose();
      calibration_gradient.noalias() -= calibration_point * inverse * gradient;
    }
    system.cost = priorCost(window) + bend() * costs.value();
  }

  /// The next estimate of poses, points and calibration; observations stay those of the window.
  void makeStep(const ReducedSystem& system, const Eigen::VectorXd& step, Window& next) const {
    next.camera = window_->camera;
    next.T_camera_origin = window_->T_camera_origin;
    next.points = window_->points;
    next.calibration = window_->calibration;
    next.calibration_prior = window_->calibration_prior;
    for (int f = 0; f < poses_; ++f)
      next.T_camera_origin[f + 1] = expSE3(step.segment<6>(6 * f)) * window_->T_camera_origin[f + 1];
    const CalibrationVector calibration = step.tail<kCalibration>();
    next.calibration.value += calibration;
    int sighting = 0;
    for (std::size_t p = 0; p + 1 < first_of_point_.size(); ++p) {
      Eigen::Vector3d gradient = system.points[p].gradient - system.calibration_point[p].transpose() * calibration;
      for (; sighting < system.points[p].end; ++sighting)
        gradient -= system.pose_point[sighting].transpose() * step.segment<6>(6 * system.pose[sighting]);
      next.points[window_->observations[first_of_point_[p]].point].ray_and_inverse_depth +=
          system.points[p].inverse_hessian * gradient;
    }
  }

 private:
  /// Of n disparities of one point the mean has the variance sigma^2 / n + common^2, as if each by itself had n times
  /// that: more sightings do not average away what they share.
  Eigen::Vector3d inverseNoise(const WindowObservation& observation) const {
    const double variance = options_.disparity_sigma * options_.disparity_sigma +
                            sightings_[static_cast<std::size_t>(observation.point)] * common_sigma_ * common_sigma_;
    return {1.0 / observation.sigma, 1.0 / observation.sigma, 1.0 / std::sqrt(variance)};
  }

  WindowOptimizerOptions options_;
  const Window* window_ = nullptr;
  double common_sigma_ = 0.0;
  std::vector<int> first_of_point_;
  std::vector<int> sightings_;                  ///< of each point
  std::vector<Eigen::Vector3d> inverse_noise_;  ///< of each observation
  RelativePoses T_camera_anchor_;
  std::vector<WeightedSighting> of_point_;
  std::vector<PosePoint> scaled_;  ///< for each of them: by the pose and the point, times the point's inverse Hessian
  int poses_ = 0, size_ = 0;
};

}  // namespace

bool predictFromAnchor(const StereoCamera& camera, const Eigen::Isometry3d& T_camera_anchor,
                       const Eigen::Vector3d& ray_and_inverse_depth, Eigen::Vector3d& prediction,
                       ObservationJacobians* jacobians) {
  constexpr double kNearest = 1e-3;  // of the depth in the anchor
  const auto R = T_camera_anchor.linear();
  const auto t = T_camera_anchor.translation();
  const double rho = ray_and_inverse_depth.z();
  const Eigen::Vector3d P =
      R.col(0) * ray_and_inverse_depth.x() + R.col(1) * ray_and_inverse_depth.y() + R.col(2) + rho * t;
  if (P.z() < kNearest) return false;
  const double iz = 1.0 / P.z();
  const double x = P.x() * iz, y = P.y() * iz, fb = camera.fx * camera.baseline;
  prediction = {camera.fx * x + camera.cx, camera.fy * y + camera.cy, fb * rho * iz};
  if (!jacobians) return true;

  // By the scaled point, rho held: (a, 0, -a x), (0, b, -b y), (0, 0, -d). A turn moves the point by -skew(P).
  const double a = camera.fx * iz, b = camera.fy * iz, d = fb * rho * iz * iz;
  jacobians->pose << rho * a, 0.0, -rho * a * x, -a * x * P.y(), a * (P.z() + x * P.x()), -a * P.y(),  //
      0.0, rho * b, -rho * b * y, -b * (P.z() + y * P.y()), b * y * P.x(), b * P.x(),                  //
      0.0, 0.0, -rho * d, -d * P.y(), d * P.x(), 0.0;
  const auto byDirection = [&](const auto& w) -> Eigen::Vector3d {
    return {a * (w.x() - x * w.z()), b * (w.y() - y * w.z()), -d * w.z()};
  };
  jacobians->point.col(0) = byDirection(R.col(0));
  jacobians->point.col(1) = byDirection(R.col(1));
  jacobians->point.col(2) = byDirection(t);
  jacobians->point(2, 2) += fb * iz;
  return true;
}

bool predictObservation(const StereoCamera& camera, const Eigen::Isometry3d& T_camera_origin,
                        const AnchoredPoint& point, Eigen::Vector3d& prediction, ObservationJacobians* jacobians) {
  return predictFromAnchor(camera, T_camera_origin * point.T_origin_anchor, point.ray_and_inverse_depth, prediction,
                           jacobians);
}

struct WindowOptimizer::Memory {
  explicit Memory(const WindowOptimizerOptions& options) : solver(options) {}

  Solver solver;
  ReducedSystem system;
  Window next;
  Eigen::MatrixXd hessian, units, covariance;
  Eigen::LDLT<Eigen::MatrixXd> factor;
  Eigen::VectorXd step;
  std::vector<double> squares;
  WindowSolution solution;
};

WindowOptimizer::WindowOptimizer(const WindowOptimizerOptions& options)
    : options_(checked(options)), memory_(std::make_unique<Memory>(options_)) {}

WindowOptimizer::WindowOptimizer(WindowOptimizer&&) noexcept = default;
WindowOptimizer& WindowOptimizer::operator=(WindowOptimizer&&) noexcept = default;
WindowOptimizer::~WindowOptimizer() = default;

const WindowSolution& WindowOptimizer::optimize(Window& window) {
  std::vector<int> all(window.T_camera_origin.size() - 1);
  std::iota(all.begin(), all.end(), 1);
  return optimize(window, all);
}

const WindowSolution& WindowOptimizer::optimize(Window& window, const std::vector<int>& covariance_of) {
  constexpr double kUndamped = 1e-5, kLargestDamping = 1e4;
  auto& [solver, system, next, hessian, units, covariance, factor, step, squares, solution] = *memory_;
  solver.take(window);
  solution.success = false;
  solution.iterations = 0;
  double damping = kUndamped, damping_of_system = kUndamped;
  bool accepted = false;
  const int c = 6 * solver.poses();
  while (solution.iterations < options_.iterations && damping < kLargestDamping) {
    ++solution.iterations;
    solver.linearise(window, damping, system);
    damping_of_system = damping;
    hessian = system.hessian;  // its lower triangle
    hessian.diagonal().head(c) *= 1.0 + damping;
    step = factor.compute(hessian).solve(system.gradient);
    if (!step.allFinite()) return solution;
    solver.makeStep(system, step, next);
    const double next_cost = solver.cost(next, squares);
    accepted = next_cost <= system.cost;
    if (accepted) {
      const bool converged = system.cost - next_cost < 1e-4 * (system.cost + 1.0);
      std::swap(window.T_camera_origin, next.T_camera_origin);
      std::swap(window.points, next.points);
      window.calibration = next.calibration;
      damping = std::max(0.1 * damping, 1e-8);
      if (converged) break;
    } else {
      damping *= 100.0;
    }
  }

  // Of the last linearisation, one step before the result: close enough for a covariance, and half of the work saved.
  // But points held by damping would say too much.
  if (damping_of_system > kUndamped) solver.linearise(window, kUndamped, system);
  factor.compute(system.hessian);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return solution;
  const int asked = static_cast<int>(covariance_of.size());
  units.setZero(solver.size(), 6 * asked + kCalibration);
  for (int a = 0; a < asked; ++a)
    units.block<6, 6>(6 * (covariance_of[static_cast<std::size_t>(a)] - 1), 6 * a).setIdentity();
  units.bottomRightCorner<kCalibration, kCalibration>().setIdentity();
  covariance = factor.solve(units);
  const double points = static_cast<double>(window.points.size());
  const double degrees_of_freedom = std::max(3.0 * system.weight - 3.0 * points - c, 1.0);
  const double variance = system.weighted_square / degrees_of_freedom;
  solution.pose_covariance.resize(6 * asked, 6 * asked);
  for (int a = 0; a < asked; ++a)
    solution.pose_covariance.middleRows<6>(6 * a) =
        variance * covariance.block(6 * (covariance_of[static_cast<std::size_t>(a)] - 1), 0, 6, 6 * asked);
  solution.calibration_information =
      covariance.bottomRightCorner<kCalibration, kCalibration>().inverse() - window.calibration_prior.information;

  if (!accepted) solver.cost(window, squares);  // those at hand belong to a refused step
  solution.residuals.clear();
  for (const double square : squares) solution.residuals.push_back(std::sqrt(square));
  solution.common_disparity_square = varianceOf(system.common_squares);
  solution.success = solution.pose_covariance.allFinite();
  return solution;
}

}  // namespace sdvo
