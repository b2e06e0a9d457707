#include "row_delay.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

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

int RowDelay::cellOf(double u, double v, int width, int height) {
  // Clamped before it becomes an integer, which a position far outside of the image overflows.
  const auto part = [](double position, int size, int count) {
    return static_cast<int>(std::clamp(position * count / size, 0.0, count - 1.0));
  };
  return part(v, height, kRows) * kColumns + part(u, width, kColumns);
}

double RowDelay::Estimate::proved() const {
  return std::copysign(std::sqrt(std::max(value * value - kSquare * sigma * sigma, 0.0)), value);
}

RowDelay::Fit RowDelay::fit(const Cells& cells) {
  Fit fit;
  Eigen::Vector2d product = Eigen::Vector2d::Zero();
  for (const Sums& cell : cells) {
    if (!(cell.weight > 0.0)) continue;
    const Eigen::Matrix3d square = cell.square - cell.motion * cell.meanMotion().transpose();
    fit.information.row(0) += square.row(0).tail<2>();
    fit.information.row(1) += square.row(2).tail<2>();
    product += instruments(cell.product - cell.motion * cell.meanDv());
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

/// Each part of the pair is one observation: the mean of its samples, weighted by a Huber kernel. Differences within a
/// part are not used: on a road they have the same pattern in all pairs, as the rectification's error has.
void RowDelay::add(const std::vector<Sample>& pair) {
  constexpr int kReweightings = 3;
  double square = 0.0;
  for (const Sample& row : pair) square += row.turning * row.turning;
  if (!(square > least_turning_ * least_turning_ * static_cast<double>(pair.size()))) return;

  Cells past = cells_;
  for (Sums& cell : past) {
    cell.weight *= memory_, cell.dv *= memory_;
    cell.motion *= memory_, cell.square *= memory_, cell.product *= memory_;
  }
  std::vector<double> weights(pair.size(), 1.0);
  Eigen::Vector2d gradient;
  for (int pass = 0; pass < kReweightings; ++pass) {
    Cells now;
    for (std::size_t i = 0; i < pair.size(); ++i)
      now[static_cast<std::size_t>(pair[i].cell)].add(weights[i], motionOf(pair[i]), pair[i].dv);
    cells_ = past;
    for (std::size_t cell = 0; cell < now.size(); ++cell)
      if (now[cell].weight > 0.0) cells_[cell].add(now[cell].weight, now[cell].meanMotion(), now[cell].meanDv());
    const Eigen::Vector2d value = fit(cells_).value;
    const auto rest = [&](const Sums& cell, const Eigen::Vector3d& motion, double dv) {
      return dv - cell.meanDv() - value.dot(regressors(motion - cell.meanMotion()));
    };
    gradient.setZero();
    for (std::size_t cell = 0; cell < now.size(); ++cell)
      if (now[cell].weight > 0.0)
        gradient += now[cell].weight * rest(cells_[cell], now[cell].meanMotion(), now[cell].meanDv()) *
                    instruments(now[cell].meanMotion() - cells_[cell].meanMotion());
    for (std::size_t i = 0; i < pair.size(); ++i) {
      const Sums& cell = cells_[static_cast<std::size_t>(pair[i].cell)];
      weights[i] = std::min(1.0, kKernel / std::max(std::abs(rest(cell, motionOf(pair[i]), pair[i].dv)), 1e-9));
    }
  }
  block_ += gradient;
  if (++pairs_ % pairs_of_block_ != 0) return;
  const double memory = std::pow(memory_, pairs_of_block_);
  spread_ = memory * memory * spread_ + block_ * block_.transpose();
  blocks_ = memory * blocks_ + 1.0;
  block_.setZero();
}

std::optional<RowDelay::Estimate> RowDelay::estimate() const {
  const double freedom = blocks_ - 2.0;
  if (!(freedom > 0.0)) return std::nullopt;
  const Fit fit = this->fit(cells_);
  const Eigen::Matrix2d inverse = fit.information.inverse();
  // The spread of few blocks is uncertain: Student's distribution, by Wallace's bound of its quantiles.
  const double few = freedom / kSquare * std::expm1(kSquare / freedom);
  const Estimate estimate{fit.value[0], std::sqrt(few * (inverse * spread_ * inverse.transpose())(0, 0))};
  if (!(estimate.sigma < kFail)) return std::nullopt;
  return estimate;
}

}  // namespace sdvo
