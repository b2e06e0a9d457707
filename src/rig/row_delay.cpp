#include "row_delay.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "../common/statistics.hpp"

namespace sdvo {
namespace {

Eigen::Vector3d motionOf(const RowDelay::Sample& row) {
  return {row.turning, row.velocity, row.disparity};
}

Eigen::Vector2d regressors(const Eigen::Vector3d& motion) {
  return motion.tail<2>();
}

Eigen::Vector2d instruments(const Eigen::Vector3d& motion) {
  return {motion[0], motion[2]};
}

}  // namespace

double RowDelay::Estimate::significantValue() const {
  return std::copysign(std::sqrt(std::max(value * value - kSquare * sigma * sigma, 0.0)), value);
}

RowDelay::Fit RowDelay::fit(const Parts& parts) {
  Fit fit;
  Eigen::Vector2d product = Eigen::Vector2d::Zero();
  for (const Sums& part : parts) {
    if (!(part.weight > 0.0)) continue;
    const Eigen::Matrix3d square = part.square - part.motion * part.meanMotion().transpose();
    // Instruments (turning, disparity) times regressors (velocity, disparity): not symmetric.
    fit.information.row(0) += square.row(0).tail<2>();
    fit.information.row(1) += square.row(2).tail<2>();
    product += instruments(part.product - part.motion * part.meanDv());
  }
  constexpr double kSteady = 1e-6;  // keeps the equations solvable where all disparities are equal
  fit.information.diagonal().array() += kSteady;
  fit.value = fit.information.inverse() * product;
  return fit;
}

void RowDelay::Sums::add(double w, const Eigen::Vector3d& moved, double lower) {
  weight += w;
  motion += w * moved;
  dv += w * lower;
  square += w * moved * moved.transpose();
  product += w * lower * moved;
}

double RowDelay::Sums::residual(const Eigen::Vector2d& value, const Eigen::Vector3d& moved, double lower) const {
  return lower - meanDv() - value.dot(regressors(moved - meanMotion()));
}

/// Each part of the pair is one observation: the mean of its samples, weighted by a Huber kernel. Differences within a
/// part are not used: on a road they have the same pattern in all pairs, as the rectification's error has.
void RowDelay::add(const std::vector<Sample>& pair) {
  constexpr int kReweightings = 3;
  double square = 0.0;
  for (const Sample& row : pair) square += row.turning * row.turning;
  if (!(square > least_turning_ * least_turning_ * static_cast<double>(pair.size()))) return;

  Parts past = parts_;
  for (Sums& part : past) {
    part.weight *= memory_, part.dv *= memory_;
    part.motion *= memory_, part.square *= memory_, part.product *= memory_;
  }
  std::vector<double> weights(pair.size(), 1.0);
  Parts now;
  Eigen::Vector2d value;
  for (int pass = 0; pass < kReweightings; ++pass) {
    now = Parts();
    for (std::size_t i = 0; i < pair.size(); ++i) now[pair[i].part].add(weights[i], motionOf(pair[i]), pair[i].dv);
    parts_ = past;
    for (std::size_t part = 0; part < now.size(); ++part)
      if (now[part].weight > 0.0) parts_[part].add(now[part].weight, now[part].meanMotion(), now[part].meanDv());
    value = fit(parts_).value;
    for (std::size_t i = 0; i < pair.size(); ++i) {
      const Sums& part = parts_[pair[i].part];
      const double residual = std::abs(part.residual(value, motionOf(pair[i]), pair[i].dv));
      weights[i] = std::min(1.0, kKernel / std::max(residual, 1e-9));
    }
  }

  // Instruments times residual. Once the pair's block is complete, the square of its gradient joins the sum.
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  for (std::size_t part = 0; part < now.size(); ++part)
    if (now[part].weight > 0.0)
      gradient += now[part].weight * parts_[part].residual(value, now[part].meanMotion(), now[part].meanDv()) *
                  instruments(now[part].meanMotion() - parts_[part].meanMotion());
  block_ += gradient;
  if (++pairs_ % pairs_of_block_ != 0) return;
  const double memory = std::pow(memory_, pairs_of_block_);
  gradient_squares_ = memory * memory * gradient_squares_ + block_ * block_.transpose();
  blocks_ = memory * blocks_ + 1.0;
  block_.setZero();
}

std::optional<RowDelay::Estimate> RowDelay::estimate() const {
  const double freedom = blocks_ - 2.0;
  if (!(freedom > 0.0)) return std::nullopt;
  const Fit fit = this->fit(parts_);
  const Eigen::Matrix2d inverse = fit.information.inverse();
  const double student = freedom / kSquare * studentSquare(kSquare, freedom);  // the spread of few blocks is uncertain
  const Estimate estimate{fit.value[0], std::sqrt(student * (inverse * gradient_squares_ * inverse.transpose())(0, 0))};
  if (!(estimate.sigma < kFail)) return std::nullopt;
  return estimate;
}

}  // namespace sdvo
