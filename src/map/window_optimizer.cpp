#include "stereo_descriptor_vo/map/window_optimizer.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "../common/statistics.hpp"
#include "point_elimination.hpp"
#include "stereo_descriptor_vo/motion/motion_refinement.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {
inline namespace window_optimizing {  // with a name: WindowOptimizer::Memory has fields of these types

using CalibrationVector = RigCalibration::Vector;

/// Normal equations of poses and calibration after the elimination of the points, and the factors for the points'
/// steps.
struct ReducedSystem {
  Eigen::MatrixXd hessian;  ///< lower triangle: poses but the first, then the calibration
  Eigen::VectorXd gradient;
  std::vector<EliminatedPoint> points;
  std::vector<PoseFactor> factors;  ///< sorted by point
  double cost = 0.0;
};

/// The unknowns: poses, points (ray and inverse depth of each point with an observation, in their order), calibration.
struct Estimate {
  std::vector<Eigen::Isometry3d> T_camera_origin;
  std::vector<Eigen::Vector3d> points;
  RigCalibration calibration;
};

/// Square of the mean residual of a point's disparities, in standard deviations: the error that they share. The point's
/// estimate follows a part of that error; the result is corrected for this part. None if it is more than half.
std::optional<double> commonSquare(const EliminatedPoint& point) {
  constexpr int kFewest = 4;
  if (point.observations < kFewest) return std::nullopt;
  const double followed = (point.R * point.disparity_by_point).squaredNorm() / point.weight;
  if (followed > 0.5) return std::nullopt;
  const double mean = point.disparity_residual / point.weight;
  return mean * mean / (1.0 - followed);
}

/// Variance of a normal distribution by the median of its squares; none if they are too few. Reorders them.
std::optional<double> varianceOf(std::vector<double>& squares) {
  constexpr double kMedianOfChiSquare = 0.4549;  // of one degree of freedom
  if (squares.size() < kFewestMeasured) return std::nullopt;
  return median(squares) / kMedianOfChiSquare;
}

/// Linear algebra of a window. Reuses its memory for the next one.
class Solver {
 public:
  explicit Solver(const WindowOptimizerOptions& options) : options_(options) {}

  /// Starts with a window, which must stay valid; its values become the first estimate.
  void take(const Window& window, Estimate& estimate) {
    window_ = &window;
    common_sigma_ = window.calibration_prior.common_sigma.value_or(options_.noise.common_disparity);
    const auto& observations = window.observations;
    first_of_point_.clear();
    anchors_.clear(), anchor_of_point_.clear(), estimate.points.clear();
    for (std::size_t i = 0; i < observations.size(); ++i) {
      if (i > 0 && observations[i].point == observations[i - 1].point) continue;
      first_of_point_.push_back(static_cast<int>(i));
      const AnchoredPoint& point = window.points[static_cast<std::size_t>(observations[i].point)];
      // Points with the same anchor follow each other.
      if (anchors_.empty() || point.T_origin_anchor.matrix() != anchors_.back().matrix())
        anchors_.push_back(point.T_origin_anchor);
      anchor_of_point_.push_back(anchors_.size() - 1);
      estimate.points.push_back(point.ray_and_inverse_depth);
    }
    first_of_point_.push_back(static_cast<int>(observations.size()));
    estimate.T_camera_origin = window.T_camera_origin;
    estimate.calibration = window.calibration;
    poses_ = static_cast<int>(window.T_camera_origin.size()) - 1;
    size_ = 6 * poses_ + kCalibration;
  }

  /// Writes the estimate into the window that take() was given.
  void give(const Estimate& estimate, Window& window) const {
    window.T_camera_origin = estimate.T_camera_origin;
    window.calibration = estimate.calibration;
    for (std::size_t p = 0; p < estimate.points.size(); ++p) {
      const WindowObservation& first = window.observations[static_cast<std::size_t>(first_of_point_[p])];
      window.points[static_cast<std::size_t>(first.point)].ray_and_inverse_depth = estimate.points[p];
    }
  }

  int poses() const { return poses_; }
  int size() const { return size_; }

  /// Square of the residual at which the Cauchy kernel bends: a square s costs bend * log(1 + s / bend).
  double bend() const { return options_.kernel_scale * options_.kernel_scale; }
  double weight(double square) const { return bend() / (bend() + square); }

  /// The cost of an estimate. Also writes the square of each observation's residual.
  double cost(const Estimate& estimate, std::vector<double>& squares) {
    squares.resize(window_->observations.size());
    const WindowProjection projection = {window_->camera, estimate.calibration};
    placeAnchors(estimate);
    for (std::size_t p = 0; p < estimate.points.size(); ++p)
      squareResiduals(projection, observedPoint(estimate, p), squares.data() + first_of_point_[p]);
    return costOf(estimate, squares);
  }

  /// Computes the reduced system at an estimate and reuses the system's memory.
  void linearise(const Estimate& estimate, double damping, ReducedSystem& system) {
    eliminatePoints(estimate, {bend(), damping}, system);
    system.hessian = equations_.hessian();
    system.gradient = equations_.gradient();
    const CalibrationBelief& prior = window_->calibration_prior;
    system.hessian.bottomRightCorner<kCalibration, kCalibration>() += prior.information;
    system.gradient.tail<kCalibration>() += prior.information * (prior.mean - estimate.calibration.value);
    if (window_->floor) holdToFloor(estimate, system.hessian, system.gradient);
    system.cost = costOf(estimate, squares_);
  }

  /// Variance, px^2, of the error that all disparities of one point share. `squares`: scratch memory.
  std::optional<double> commonVariance(const std::vector<EliminatedPoint>& points, std::vector<double>& squares) const {
    double of_means = 0.0;  // variance of a point's mean disparity by the noise that is independent in each
    squares.clear();
    for (std::size_t p = 0; p < points.size(); ++p) {
      const int observations = first_of_point_[p + 1] - first_of_point_[p];
      const auto square = commonSquare(points[p]);
      if (!square) continue;
      squares.push_back(disparityVariance(observations) * *square);
      of_means += options_.noise.disparity * options_.noise.disparity / observations;
    }
    const auto variance = varianceOf(squares);
    if (!variance) return std::nullopt;
    return *variance - of_means / static_cast<double>(squares.size());
  }

  /// Sandwich covariance of an M-estimator (Huber 1967, White 1980): A^-1 B A^-1. The bread A is the cost's second
  /// derivatives. The meat B is the sum of outer products of gradients, one gradient for each cluster of observations
  /// with correlated errors (Liang and Zeger 1986). A cluster is a part of the image: observations of a point share the
  /// error of its disparity, neighbours share those of patches and rectification. Few points make B noisy, so only
  /// the mean ratio of both covariances is taken from it, and scales A^-1. A and B are of the last linearisation and
  /// scaled to `squares`, the squared residuals at the result. `poses`: those whose covariance is needed.
  bool covariances(const Estimate& estimate, const std::vector<double>& squares, const std::vector<int>& poses,
                   ReducedSystem& system, WindowSolution& solution) {
    const RigCalibration::Matrix& prior = window_->calibration_prior.information;
    system.hessian = equations_.hessian();
    system.gradient = equations_.gradient();
    known_.setZero(size_, size_);  // information of the priors, without the points'
    known_.bottomRightCorner<kCalibration, kCalibration>() = prior;
    if (window_->floor) holdToFloor(estimate, known_, system.gradient);
    const auto [bread, meat] = sandwichScale(squares);
    system.hessian = bread * system.hessian + known_;
    factor_.compute(system.hessian);
    if (factor_.info() != Eigen::Success) return false;  // for example, no observation constrains one of the poses

    const int asked = 6 * static_cast<int>(poses.size());
    units_.setZero(size_, asked + kCalibration);
    for (int k = 0; k < asked; ++k) units_(6 * (poses[static_cast<std::size_t>(k / 6)] - 1) + k % 6, k) = 1.0;
    units_.bottomRightCorner<kCalibration, kCalibration>().setIdentity();
    solved_ = factor_.solve(units_);
    const RigCalibration::Matrix of_calibration = solved_.bottomRightCorner<kCalibration, kCalibration>();
    const RigCalibration::Matrix certainty = of_calibration.inverse();
    solution.calibration_information = (certainty - prior) / bread;
    solution.pose_by_calibration = units_.leftCols(asked).transpose() * solved_.rightCols<kCalibration>() * certainty;

    const auto of_poses = solved_.leftCols(asked);
    const Eigen::MatrixXd of_known = of_poses.transpose() * known_.selfadjointView<Eigen::Lower>() * of_poses;
    const Eigen::MatrixXd of_points = units_.leftCols(asked).transpose() * of_poses - of_known;
    solution.pose_covariance = meat * meatOverBread(system, estimate, of_poses, of_points) * of_points + of_known;
    return solution.pose_covariance.allFinite();
  }

  /// Applies a step of poses and calibration to an estimate, and the points' steps that follow from it.
  void makeStep(const Estimate& estimate, const ReducedSystem& system, const Eigen::VectorXd& step,
                Estimate& next) const {
    const CalibrationVector calibration = step.tail<kCalibration>();
    next.calibration.value = estimate.calibration.value + calibration;
    next.T_camera_origin = estimate.T_camera_origin;
    for (int f = 0; f < poses_; ++f)
      next.T_camera_origin[f + 1] = expSE3(step.segment<6>(6 * f)) * estimate.T_camera_origin[f + 1];
    next.points = estimate.points;
    movePoints(system.points, system.factors, step.head(6 * poses_), calibration, next.points);
  }

 private:
  /// Factors from matrices of the last linearisation to those at the result.
  struct SandwichScale {
    double bread;  ///< from the normal equations to the second derivatives
    double meat;   ///< from the products of gradients to those at the result
  };
  /// An observation with the weight w adds w times a product of Jacobians to the normal equations. To the second
  /// derivatives it adds w^2 times that, on average over the two directions of its residual; to the meat also w^2. The
  /// elimination of the point leaves w_i - w_i^2 / sum(w) of each. The factors are ratios of the sums of these.
  SandwichScale sandwichScale(const std::vector<double>& squares) const {
    double weights = 0.0, before = 0.0, now = 0.0;
    for (std::size_t p = 0; p + 1 < first_of_point_.size(); ++p) {
      double w1 = 0.0, w2 = 0.0, w4 = 0.0, now2 = 0.0, now4 = 0.0;  // powers
      for (int i = first_of_point_[p]; i < first_of_point_[p + 1]; ++i) {
        const double w = weight(squares_[i]), square = w * w, w_now = weight(squares[i]), now_square = w_now * w_now;
        w1 += w, w2 += square, w4 += square * square, now2 += now_square, now4 += now_square * now_square;
      }
      weights += w1 - w2 / w1, before += w2 - w4 / w2, now += now2 - now4 / now2;
    }
    return {now / std::max(weights, 1e-12), now / std::max(before, 1e-12)};
  }

  /// Mean ratio, over the directions, of the covariance from gradients to that from second derivatives: their trace
  /// ratio. The fit makes gradients smaller than the errors; the degrees of freedom correct for this.
  double meatOverBread(const ReducedSystem& system, const Estimate& estimate,
                       const Eigen::Ref<const Eigen::MatrixXd>& solved, const Eigen::MatrixXd& covariance) {
    double freedom = 0.0, trace = 0.0;  // trace of covariance^-1 times the sum of outer products
    for (const EliminatedPoint& point : system.points)
      freedom += 2.0 * point.observations - 2.0;  // u, v and one disparity against a position
    const Eigen::MatrixXd whitened = covariance.llt().matrixL().solve(solved.transpose());
    for (Eigen::Index row = 0; row < whitened.rows(); row += 6)
      trace += meatOf(system, estimate, whitened.middleRows<6>(row));
    return trace / static_cast<double>(solved.cols()) * freedom / std::max(freedom - 6.0 * poses_, 1.0);
  }

  /// Correction of a sum of squares over n clusters, before clusters of different size are compared. The gradients sum
  /// up to zero, which makes the sum smaller by (n - 1) / n. The largest of several sums is too large by chance: it is
  /// divided by the mean of 6 n squared normal numbers plus its standard deviation.
  static double largerArea(double clusters) {
    return clusters / std::max(clusters - 1.0, 1.0) / (1.0 + std::sqrt(2.0 / (6.0 * std::max(clusters, 1.0))));
  }

  /// Sum over clusters of the squared length of the cluster's gradient. A cluster is the part of the image in which a
  /// point was seen first. Enlarged images, or grass in the wind, have errors that correlate over a larger area. Hence
  /// areas of two and four times the width are tried, and the largest sum counts.
  double meatOf(const ReducedSystem& system, const Estimate& estimate,
                const Eigen::Matrix<double, 6, Eigen::Dynamic>& by) {
    constexpr int kSide = 64;  // clusters along each axis at most
    clusters_.clear();
    const double scale = window_->camera.fx / kPart;
    const auto index = [&](double ray) { return std::clamp(static_cast<int>(ray * scale + kSide / 2), 0, kSide - 1); };
    const PoseFactor* observation = system.factors.data();
    for (std::size_t p = 0; p < system.points.size(); ++p) {
      const EliminatedPoint& point = system.points[p];
      Vector6d moved = by.rightCols<kCalibration>().lazyProduct(point.calibration_gradient);
      for (const PoseFactor* end = observation + point.factors; observation != end; ++observation)
        moved += by.middleCols<6>(6 * observation->pose).lazyProduct(observation->gradient);
      clusters_.push_back({index(estimate.points[p].x()), index(estimate.points[p].y()), moved});
    }
    double most = 0.0;
    for (int side = kSide; side >= kSide / 4; side /= 2) {
      cluster_at_.assign(side * side, -1);
      int count = 0;
      for (const Cluster& part : clusters_) {
        int& at = cluster_at_[part.y * side + part.x];
        if (at < 0)
          at = count, clusters_[count++] = part;
        else
          clusters_[at].gradient += part.gradient;
      }
      clusters_.resize(count);
      double sum = 0.0;
      for (Cluster& cluster : clusters_) sum += cluster.gradient.squaredNorm(), cluster.x /= 2, cluster.y /= 2;
      most = std::max(most, side < kSide ? sum * largerArea(count) : sum);
    }
    return most;
  }

  void eliminatePoints(const Estimate& estimate, const Linearisation& linearisation, ReducedSystem& system) {
    system.points.resize(estimate.points.size());
    system.factors.resize(window_->observations.size());
    squares_.resize(window_->observations.size());
    equations_.setZero(poses_);
    const WindowProjection projection = {window_->camera, estimate.calibration};
    placeAnchors(estimate);
    PoseFactor* factors = system.factors.data();
    for (std::size_t p = 0; p < estimate.points.size(); ++p) {
      system.points[p] = equations_.add(projection, observedPoint(estimate, p), linearisation, factors,
                                        squares_.data() + first_of_point_[p]);
      factors += system.points[p].factors;
    }
  }

  /// Fills T_camera_anchor_: for each anchor the transforms of all poses.
  void placeAnchors(const Estimate& estimate) {
    T_camera_anchor_.clear();
    for (const Eigen::Isometry3d& T_origin_anchor : anchors_)
      for (const Eigen::Isometry3d& T : estimate.T_camera_origin) T_camera_anchor_.push_back(T * T_origin_anchor);
  }

  ObservedPoint observedPoint(const Estimate& estimate, std::size_t p) const {
    const int first = first_of_point_[p], count = first_of_point_[p + 1] - first;
    return {estimate.points[p], window_->observations.data() + first, count, 1.0 / std::sqrt(disparityVariance(count)),
            T_camera_anchor_.data() + anchor_of_point_[p] * estimate.T_camera_origin.size()};
  }

  double costOf(const Estimate& estimate, const std::vector<double>& squares) const {
    LogSum costs;
    for (const double square : squares) costs.add(square / bend());
    const CalibrationVector error = estimate.calibration.value - window_->calibration_prior.mean;
    return error.dot(window_->calibration_prior.information * error) + bend() * costs.value() + floorCost(estimate);
  }

  void holdToFloor(const Estimate& estimate, Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient) const {
    Floor::Jacobian jacobian;
    for (int f = 0; f < poses_; ++f) {
      const Eigen::Vector3d residual = window_->floor->residual(estimate.T_camera_origin[f + 1], &jacobian);
      const Eigen::Vector3d weights = residual.cwiseAbs2().unaryExpr(&Floor::weight);
      hessian.block<6, 6>(6 * f, 6 * f) += jacobian.transpose() * weights.asDiagonal() * jacobian;
      gradient.segment<6>(6 * f) -= jacobian.transpose() * weights.cwiseProduct(residual);
    }
  }

  double floorCost(const Estimate& estimate) const {
    double cost = 0.0;
    for (int f = 0; window_->floor && f < poses_; ++f)
      cost += window_->floor->residual(estimate.T_camera_origin[f + 1]).cwiseAbs2().unaryExpr(&Floor::cost).sum();
    return cost;
  }

  /// Variance of each of n disparities of a point. Their mean has the variance sigma^2 / n + common^2, because the
  /// error that they share does not average out. With n times this for each, independent noise gives the same mean.
  double disparityVariance(int observations) const {
    return options_.noise.disparity * options_.noise.disparity + observations * common_sigma_ * common_sigma_;
  }

  WindowOptimizerOptions options_;
  const Window* window_ = nullptr;
  double common_sigma_ = 0.0;
  std::vector<int> first_of_point_;
  std::vector<Eigen::Isometry3d> anchors_, T_camera_anchor_;
  std::vector<std::size_t> anchor_of_point_;
  PoseEquations equations_;
  std::vector<double> squares_;
  struct Cluster {
    int x, y;
    Vector6d gradient;
  };
  std::vector<Cluster> clusters_;
  std::vector<int> cluster_at_;
  Eigen::MatrixXd known_, units_, solved_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  int poses_ = 0, size_ = 0;
};

}  // namespace window_optimizing

struct WindowOptimizer::Memory {
  explicit Memory(const WindowOptimizerOptions& options) : solver(options) {}

  Solver solver;
  ReducedSystem system;
  Estimate estimate, next;
  Eigen::MatrixXd hessian;
  Eigen::LLT<Eigen::MatrixXd> factor;
  Eigen::VectorXd step;
  std::vector<double> squares, common_squares;
  WindowSolution solution;
};

WindowOptimizer::WindowOptimizer(const WindowOptimizerOptions& options)
    : options_(options), memory_(std::make_unique<Memory>(options_)) {}

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
  auto& [solver, system, estimate, next, hessian, factor, step, squares, common_squares, solution] = *memory_;
  solver.take(window, estimate);
  solution.success = false;
  solution.iterations = 0;
  double damping = kUndamped, damping_of_system = kUndamped;
  bool accepted = false;
  const int c = 6 * solver.poses();
  // A step that increases the cost is tried again with more damping.
  while (solution.iterations < options_.iterations && damping < kLargestDamping) {
    solver.linearise(estimate, damping, system);
    damping_of_system = damping;
    hessian = system.hessian;  // its lower triangle
    hessian.diagonal().head(c) *= 1.0 + damping;
    factor.compute(hessian);
    if (factor.info() != Eigen::Success) {
      accepted = false, damping *= 100.0;
      continue;
    }
    step = factor.solve(system.gradient);
    solver.makeStep(estimate, system, step, next);
    const double next_cost = solver.cost(next, squares);
    accepted = next_cost <= system.cost;
    if (accepted) {
      ++solution.iterations;
      const bool converged = system.cost - next_cost < 1e-4 * (system.cost + 1.0);
      std::swap(estimate, next);
      damping = std::max(0.1 * damping, 1e-8);
      if (converged) break;
    } else {
      damping *= 100.0;
    }
  }

  solver.give(estimate, window);

  // The last linearisation, one step before the result, is used: this saves half of the work. But damping counts as
  // information about the points, so a damped system is computed again.
  if (damping_of_system > kUndamped) solver.linearise(estimate, kUndamped, system);
  solution.common_disparity_square = solver.commonVariance(system.points, common_squares);
  if (!accepted) solver.cost(estimate, squares);  // `squares` belongs to a refused step
  if (!solver.covariances(estimate, squares, covariance_of, system, solution)) return solution;
  std::swap(solution.squares, squares);
  solution.success = true;
  return solution;
}

}  // namespace sdvo
