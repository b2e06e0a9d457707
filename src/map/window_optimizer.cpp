#include "window_optimizer.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "../common/statistics.hpp"
#include "../motion/motion_refinement.hpp"
#include "point_elimination.hpp"

namespace sdvo {
namespace {

/// Square of the mean residual of a point's disparities, in standard deviations: the error that they share. The point's
/// estimate follows the part f of that error; with the noise of positions, the residual has (1 - f) of its variance.
/// None if f is more than half.
std::optional<double> commonSquare(const EliminatedPoint& point) {
  constexpr int kFewest = 4;  // observations (chosen): the mean of fewer is mostly noise
  if (point.observations < kFewest) return std::nullopt;
  // Ratio of a common disparity error that the point's position takes over.
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

}  // namespace

/// Optimises one window after the other in the same memory.
class WindowOptimizer::Solver {
 public:
  explicit Solver(const WindowOptimizerOptions& options) : options_(options) {}

  const WindowSolution& optimize(Window& window, const std::vector<int>& covariance_of) {
    constexpr double kUndamped = 1e-5, kLargestDamping = 1e4;
    take(window);
    solution_.success = false;
    solution_.iterations = 0;
    double damping = kUndamped, damping_of_system = kUndamped;
    bool accepted = false;
    // A step that increases the cost is tried again with more damping.
    while (solution_.iterations < options_.iterations && damping < kLargestDamping) {
      linearise(damping);
      damping_of_system = damping;
      const std::optional<double> next_cost = tryStep(damping);
      accepted = next_cost && *next_cost <= cost_;
      if (!accepted) {
        damping *= 100.0;
        continue;
      }
      ++solution_.iterations;
      std::swap(estimate_, next_);
      damping = std::max(0.1 * damping, 1e-8);
      if (cost_ - *next_cost < 1e-4 * (cost_ + 1.0)) break;
    }
    give(window);

    // The last linearisation, one step before the result, is used: this saves half of the work. But damping counts as
    // information about the points, so a damped system is computed again.
    if (damping_of_system > kUndamped) linearise(kUndamped);
    solution_.common_disparity_square = commonVariance();
    if (!accepted) cost(estimate_, squares_);  // they are those of a refused step
    solution_.success = covariances(covariance_of);
    if (solution_.success) std::swap(solution_.squares, squares_);
    return solution_;
  }

 private:
  /// The unknowns: poses, points (ray and inverse depth of each point with an observation, in their order),
  /// calibration.
  struct Estimate {
    std::vector<Eigen::Isometry3d> T_camera_origin;
    std::vector<Eigen::Vector3d> points;
    RigCalibration calibration;
  };

  /// Starts with a window, which must stay valid; its values become the first estimate.
  void take(const Window& window) {
    window_ = &window;
    common_sigma_ = window.calibration_prior.common_sigma.value_or(options_.noise.common_disparity);
    const auto& observations = window.observations;
    first_of_point_.clear();
    anchors_.clear(), anchor_of_point_.clear(), estimate_.points.clear();
    for (std::size_t i = 0; i < observations.size(); ++i) {
      if (i > 0 && observations[i].point == observations[i - 1].point) continue;
      first_of_point_.push_back(static_cast<int>(i));
      const AnchoredPoint& point = window.points[static_cast<std::size_t>(observations[i].point)];
      // Points with the same anchor follow each other.
      if (anchors_.empty() || point.T_origin_anchor.matrix() != anchors_.back().matrix())
        anchors_.push_back(point.T_origin_anchor);
      anchor_of_point_.push_back(anchors_.size() - 1);
      estimate_.points.push_back(point.ray_and_inverse_depth);
    }
    first_of_point_.push_back(static_cast<int>(observations.size()));
    estimate_.T_camera_origin = window.T_camera_origin;
    estimate_.calibration = window.calibration;
    poses_ = static_cast<int>(window.T_camera_origin.size()) - 1;
  }

  /// Writes the estimate into the window that take() was given.
  void give(Window& window) const {
    window.T_camera_origin = estimate_.T_camera_origin;
    window.calibration = estimate_.calibration;
    for (std::size_t p = 0; p < estimate_.points.size(); ++p) {
      const WindowObservation& first = window.observations[static_cast<std::size_t>(first_of_point_[p])];
      window.points[static_cast<std::size_t>(first.point)].ray_and_inverse_depth = estimate_.points[p];
    }
  }

  /// Square of the Cauchy kernel's scale k: a square s costs k^2 log(1 + s / k^2).
  double kernelSquare() const { return options_.kernel_scale * options_.kernel_scale; }
  double weight(double square) const { return kernelSquare() / (kernelSquare() + square); }

  /// The cost of an estimate. Also writes the square of each observation's residual.
  double cost(const Estimate& estimate, std::vector<double>& squares) {
    squares.resize(window_->observations.size());
    const WindowProjection projection = {window_->camera, estimate.calibration};
    placeAnchors(estimate);
    for (std::size_t p = 0; p < estimate.points.size(); ++p)
      squareResiduals(projection, observedPoint(estimate, p), squares.data() + first_of_point_[p]);
    return costOf(estimate, squares);
  }

  /// Normal equations and cost at the estimate, and the factors for the points' steps.
  void linearise(double damping) {
    points_.resize(estimate_.points.size());
    factors_.resize(window_->observations.size());
    linearised_squares_.resize(window_->observations.size());
    equations_.setZero(poses_);
    const WindowProjection projection = {window_->camera, estimate_.calibration};
    placeAnchors(estimate_);
    PoseFactor* factors = factors_.data();
    for (std::size_t p = 0; p < points_.size(); ++p) {
      points_[p] = equations_.add(projection, observedPoint(estimate_, p), {kernelSquare(), damping}, factors,
                                  linearised_squares_.data() + first_of_point_[p]);
      factors += points_[p].factors;
    }
    equations_.writeHessian(hessian_);
    gradient_ = equations_.gradient();
    addPriors(hessian_, gradient_);
    cost_ = costOf(estimate_, linearised_squares_);
  }

  /// Adds the priors of the calibration and of the floor.
  void addPriors(Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient) const {
    const CalibrationBelief& prior = window_->calibration_prior;
    hessian.bottomRightCorner<kCalibration, kCalibration>() += prior.information;
    gradient.tail<kCalibration>() += prior.information * (prior.mean - estimate_.calibration.value);
    Floor::Jacobian jacobian;
    for (int f = 0; window_->floor && f < poses_; ++f) {
      const Eigen::Vector3d residual = window_->floor->residual(estimate_.T_camera_origin[f + 1], &jacobian);
      const Eigen::Vector3d weights = residual.cwiseAbs2().unaryExpr(&Floor::weight);
      hessian.block<6, 6>(6 * f, 6 * f) += jacobian.transpose() * weights.asDiagonal() * jacobian;
      gradient.segment<6>(6 * f) -= jacobian.transpose() * weights.cwiseProduct(residual);
    }
  }

  /// Computes the estimate after a damped step, and its cost. None if the equations do not determine the step.
  std::optional<double> tryStep(double damping) {
    damped_ = hessian_;  // its lower triangle
    damped_.diagonal().head(6 * poses_) *= 1.0 + damping;
    factor_.compute(damped_);
    if (factor_.info() != Eigen::Success) return std::nullopt;
    step_ = factor_.solve(gradient_);
    const RigCalibration::Vector of_calibration = step_.tail<kCalibration>();
    next_.calibration.value = estimate_.calibration.value + of_calibration;
    next_.T_camera_origin = estimate_.T_camera_origin;
    for (int f = 0; f < poses_; ++f)
      next_.T_camera_origin[f + 1] = expSE3(step_.segment<6>(6 * f)) * estimate_.T_camera_origin[f + 1];
    next_.points = estimate_.points;
    movePoints(points_, factors_, step_.head(6 * poses_), of_calibration, next_.points);
    return cost(next_, squares_);
  }

  /// Variance, px^2, of the error that all disparities of one point share.
  std::optional<double> commonVariance() {
    double of_means = 0.0;  // variance of a point's mean disparity by the noise that is independent in each
    common_squares_.clear();
    for (std::size_t p = 0; p < points_.size(); ++p) {
      const int observations = first_of_point_[p + 1] - first_of_point_[p];
      const auto square = commonSquare(points_[p]);
      if (!square) continue;
      common_squares_.push_back(disparityVariance(observations) * *square);
      of_means += options_.noise.disparity * options_.noise.disparity / observations;
    }
    const auto variance = varianceOf(common_squares_);
    if (!variance) return std::nullopt;
    return *variance - of_means / static_cast<double>(common_squares_.size());
  }

  /// Sandwich covariance of an M-estimator (Huber 1967, White 1980): A^-1 B A^-1. The bread A is the cost's second
  /// derivatives. The meat B is the sum of outer products of gradients, one gradient for each cluster of observations
  /// with correlated errors (Liang and Zeger 1986). A cluster is a part of the image: observations of a point share the
  /// error of its disparity, neighbours share those of patches and rectification. Few points make B noisy. Hence only
  /// the mean ratio of both covariances is taken from B, as a factor on A^-1. A and B are of the last linearisation,
  /// scaled to `squares_`, the squared residuals at the result. False if an observation is missing that constrains a
  /// pose. `poses`: those whose covariance is needed.
  bool covariances(const std::vector<int>& poses) {
    const int size = 6 * poses_ + kCalibration;
    // Information of the priors alone, which the sandwich leaves as it is; then the second derivatives at the result.
    priors_.setZero(size, size);
    addPriors(priors_, gradient_);  // the gradient is not needed any more
    const auto [bread, meat] = sandwichScale();
    equations_.writeHessian(hessian_);
    hessian_ = bread * hessian_ + priors_;
    factor_.compute(hessian_);
    if (factor_.info() != Eigen::Success) return false;

    // Columns of the inverse: those of the poses that are asked for, and the calibration's.
    const int asked = 6 * static_cast<int>(poses.size());
    units_.setZero(size, asked + kCalibration);
    for (int k = 0; k < asked; ++k) units_(6 * (poses[static_cast<std::size_t>(k / 6)] - 1) + k % 6, k) = 1.0;
    units_.bottomRightCorner<kCalibration, kCalibration>().setIdentity();
    solved_ = factor_.solve(units_);
    const RigCalibration::Matrix of_calibration = solved_.bottomRightCorner<kCalibration, kCalibration>();
    const RigCalibration::Matrix information = of_calibration.inverse();
    // Of the normal equations themselves, without `bread`: CalibrationFilter::kRealInformation scales it.
    solution_.calibration_information = (information - window_->calibration_prior.information) / bread;
    solution_.pose_by_calibration =
        units_.leftCols(asked).transpose() * solved_.rightCols<kCalibration>() * information;

    // The poses' covariance has a part by the priors' information and one by the points'; the sandwich scales the
    // latter.
    const auto of_poses = solved_.leftCols(asked);
    const Eigen::MatrixXd of_priors = of_poses.transpose() * priors_.selfadjointView<Eigen::Lower>() * of_poses;
    const Eigen::MatrixXd of_points = units_.leftCols(asked).transpose() * of_poses - of_priors;
    solution_.pose_covariance = meat * meatOverBread(of_poses, of_points) * of_points + of_priors;
    return solution_.pose_covariance.allFinite();
  }

  /// Factors from matrices of the last linearisation to those at the result.
  struct SandwichScale {
    double bread;  ///< from the normal equations to the second derivatives
    double meat;   ///< from the products of gradients to those at the result
  };
  /// An observation with the weight w = 1 / (1 + s) adds w times a product of Jacobians to the normal equations. The
  /// second derivative of its cost is 2 w^2 - w along the residual of the square s, and w across it: w^2 on average of
  /// the image's two directions. Gradients are w times the residual, so the meat has w^2, too; the residuals' own size
  /// is that of meatOverBread(), before and now. The elimination of the point leaves w_i - w_i^2 / sum(w) of each. The
  /// factors are ratios of the sums of these.
  SandwichScale sandwichScale() const {
    double weights = 0.0, before = 0.0, now = 0.0;
    for (std::size_t p = 0; p + 1 < first_of_point_.size(); ++p) {
      double sum_w = 0.0, sum_w2 = 0.0, sum_w4 = 0.0, sum_now2 = 0.0, sum_now4 = 0.0;
      for (int i = first_of_point_[p]; i < first_of_point_[p + 1]; ++i) {
        const double w = weight(linearised_squares_[i]), w2 = w * w, w_now = weight(squares_[i]), now2 = w_now * w_now;
        sum_w += w, sum_w2 += w2, sum_w4 += w2 * w2, sum_now2 += now2, sum_now4 += now2 * now2;
      }
      weights += sum_w - sum_w2 / sum_w;
      before += sum_w2 - sum_w4 / sum_w2, now += sum_now2 - sum_now4 / sum_now2;
    }
    return {now / std::max(weights, 1e-12), now / std::max(before, 1e-12)};
  }

  /// Mean ratio, over the directions, of the covariance from gradients to that from second derivatives: their trace
  /// ratio. The fit makes gradients smaller than the errors; the degrees of freedom correct for this.
  double meatOverBread(const Eigen::Ref<const Eigen::MatrixXd>& solved, const Eigen::MatrixXd& covariance) {
    double freedom = 0.0, trace = 0.0;  // trace of covariance^-1 times the sum of outer products
    for (const EliminatedPoint& point : points_)
      freedom += 2.0 * point.observations - 2.0;  // u, v and one disparity against a position
    const Eigen::MatrixXd whitened = covariance.llt().matrixL().solve(solved.transpose());
    for (Eigen::Index row = 0; row < whitened.rows(); row += 6) trace += meatOf(whitened.middleRows<6>(row));
    return trace / static_cast<double>(solved.cols()) * freedom / std::max(freedom - 6.0 * poses_, 1.0);
  }

  /// Correction of a sum of squares over n larger clusters, before it is compared with that over smaller ones. The
  /// gradients sum up to zero, which makes the sum smaller by (n - 1) / n. The largest of several sums is too large by
  /// chance: it is divided by the mean of 6 n squared normal numbers plus its standard deviation.
  static double correctionOfClusters(double clusters) {
    return clusters / std::max(clusters - 1.0, 1.0) / (1.0 + std::sqrt(2.0 / (6.0 * std::max(clusters, 1.0))));
  }

  /// Sum over clusters of the squared length of the cluster's gradient. A cluster is the part of the image in which a
  /// point was seen first. Enlarged images, or grass in the wind, have errors that correlate over a larger area. Hence
  /// areas of two and four times the width are tried, and the largest sum counts.
  double meatOf(const Eigen::Matrix<double, 6, Eigen::Dynamic>& by) {
    constexpr int kSide = 64;  // clusters along each axis at most
    const double scale = window_->camera.fx / kCorrelatedSide;
    const auto index = [&](double ray) { return std::clamp(static_cast<int>(ray * scale + kSide / 2), 0, kSide - 1); };
    gradients_.resize(points_.size());
    sumGradients(points_, factors_, by, gradients_);
    clusters_.clear();  // one for each point; each pass merges those in the same cell of a grid that is twice as coarse
    for (std::size_t p = 0; p < points_.size(); ++p)
      clusters_.push_back({index(estimate_.points[p].x()), index(estimate_.points[p].y()), gradients_[p].head<6>()});
    double most = 0.0;
    for (int side = kSide; side >= kSide / 4; side /= 2) {
      cluster_at_.assign(side * side, -1);
      int count = 0;
      for (const Cluster& smaller : clusters_) {
        int& at = cluster_at_[smaller.y * side + smaller.x];
        if (at < 0)
          at = count, clusters_[count++] = smaller;
        else
          clusters_[at].gradient += smaller.gradient;
      }
      clusters_.resize(count);
      double sum = 0.0;
      for (Cluster& cluster : clusters_) sum += cluster.gradient.squaredNorm(), cluster.x /= 2, cluster.y /= 2;
      most = std::max(most, side < kSide ? sum * correctionOfClusters(count) : sum);
    }
    return most;
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
    CauchyCost costs;
    for (const double square : squares) costs.add(square / kernelSquare());
    const RigCalibration::Vector error = estimate.calibration.value - window_->calibration_prior.mean;
    return error.dot(window_->calibration_prior.information * error) + kernelSquare() * costs.value() +
           floorCost(estimate);
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
  int poses_ = 0;  ///< that may move
  std::vector<int> first_of_point_;
  std::vector<Eigen::Isometry3d> anchors_, T_camera_anchor_;
  std::vector<std::size_t> anchor_of_point_;
  Estimate estimate_, next_;

  // Of the last linearisation.
  PoseEquations equations_;  ///< without priors
  Eigen::MatrixXd hessian_;  ///< lower triangle: poses but the first, then the calibration
  Eigen::VectorXd gradient_;
  std::vector<EliminatedPoint> points_;
  std::vector<PoseFactor> factors_;  ///< sorted by point
  std::vector<double> linearised_squares_;
  double cost_ = 0.0;

  struct Cluster {
    int x, y;
    Vector6d gradient;
  };
  std::vector<Cluster> clusters_;
  std::vector<FactorColumn> gradients_;
  std::vector<int> cluster_at_;
  Eigen::MatrixXd damped_, priors_, units_, solved_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd step_;
  std::vector<double> squares_, common_squares_;
  WindowSolution solution_;
};

WindowOptimizer::WindowOptimizer(const WindowOptimizerOptions& options) : solver_(std::make_unique<Solver>(options)) {}

WindowOptimizer::WindowOptimizer(WindowOptimizer&&) noexcept = default;
WindowOptimizer& WindowOptimizer::operator=(WindowOptimizer&&) noexcept = default;
WindowOptimizer::~WindowOptimizer() = default;

const WindowSolution& WindowOptimizer::optimize(Window& window, const std::vector<int>& covariance_of) {
  return solver_->optimize(window, covariance_of);
}

}  // namespace sdvo
