#include "row_readout.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <limits>

#include "../common/statistics.hpp"
#include "../motion/motion_refinement.hpp"
#include "../motion/noise.hpp"
#include "rolling_shutter.hpp"

namespace sdvo {
namespace {

/// px^2, of Cauchy's kernel, by the default noise of corners.
const double kKernelSquare = noiseGate(2) * NoiseOptions().corner * NoiseOptions().corner;
constexpr std::size_t kAround = 4;  // pairs before and after one, whose mean rates give the slow rate there

/// How a feature's position (u_left, v_left), px, depends on pose and readout.
struct Shift {
  /// By the pose (six rows, m and rad), by the readout (s) at the camera's rates of rotation, and by it at slow rates:
  /// the instrument.
  Eigen::Matrix<double, 8, 2> derivative;
  Eigen::Vector2d residual;  ///< see LeftResidual
};

using Rates = std::array<Eigen::Vector3d, 2>;  // of rotation at the stamps of the pair before and of the pair, rad/s

/// Shift of a point of the pair before in the pair, px for a readout of 1 s: the rotation in its row before moves the
/// point, that in its row now moves the camera.
Eigen::Vector2d shiftBy(const Rates& rates, const StereoCamera& camera, const Eigen::Matrix3d& R_current_previous,
                        const Eigen::Vector3d& before, double row_before, double row_now,
                        const Eigen::Matrix<double, 2, 6>& by_pose) {
  const Eigen::Vector3d moved = R_current_previous * rates[0].cross(before);
  return rowTime(camera, row_before) * by_pose.leftCols<3>() * moved -
         rowTime(camera, row_now) * by_pose.rightCols<3>() * rates[1];
}

}  // namespace

/// Matched features, with the same points' positions in the previous pair; some of them.
std::vector<RowReadout::Track> RowReadout::tracksOf(const StereoFeatures& features, const MotionHypothesis& found,
                                                    std::size_t most) const {
  std::vector<Track> tracks;
  if (last_positions_.empty()) return tracks;
  const std::size_t step = 1 + found.matches.size() / most;
  for (std::size_t i = 0; i < found.matches.size(); i += step) {
    const FeatureMatch& match = found.matches[i];
    const int before = found.view->newest[match.reference];
    if (before < 0) continue;
    const cv::Point2f& last = last_positions_[before];
    tracks.push_back({{last.x, last.y, found.view->pixels[match.reference].z},
                      {features.u[match.current], features.v[match.current]}});
  }
  return tracks;
}

void RowReadout::add(const StereoFeatures& features, const MotionHypothesis& found, double dt) {
  constexpr double kSteady = 0.3;  // ratio (chosen) by which intervals may differ
  // More tracks (chosen) would not make the readout more precise, because the rates err more than the positions.
  constexpr std::size_t kMost = 256;
  if (!pairs_.empty() && !(std::abs(dt - pairs_.back().dt) < kSteady * pairs_.back().dt)) pairs_.clear();
  const Eigen::Isometry3d& T = found.motion.T_current_reference;
  pairs_.push_back({features.camera, tracksOf(features, found, kMost), T, dt, logSO3(T.linear().transpose()) / dt});
  last_positions_.clear();
  for (int i = 0; i < features.count(); ++i) last_positions_.emplace_back(features.u[i], features.v[i]);
  if (pairs_.size() <= 2 * kAround) return;
  measure();
  // Compensated from its proof on, until it is no longer significant. A global shutter whose rows are off by a pixel
  // reaches 3.8 standard deviations (Karlsruhe 19, 373 pairs).
  constexpr double kProof = 5.0;  // standard deviations (chosen)
  const auto known = estimate();
  const bool is_proved = known && known->sigma < kWarn && std::abs(known->value) > kProof * known->sigma;
  is_compensated_ = known && known->isRolling() && (is_compensated_ || is_proved);
  pairs_.pop_front();
}

/// Adds the middle one of the pairs to the sums.
void RowReadout::measure() {
  // Rate at the stamp of pair `k`, and its binomial mean over five pairs.
  const auto rateAt = [&](std::size_t k) {
    return velocityAmong(pairs_[k - 1].rate, pairs_[k].rate, pairs_[k + 1].rate, pairs_[k + 2].rate);
  };
  const auto slowRateAt = [&](std::size_t k) -> Eigen::Vector3d {
    return (rateAt(k - 2) + 4.0 * rateAt(k - 1) + 6.0 * rateAt(k) + 4.0 * rateAt(k + 1) + rateAt(k + 2)) / 16.0;
  };
  const Pair& pair = pairs_[kAround];
  const StereoCamera& camera = pair.camera;
  const Eigen::Isometry3d& T = pair.T_current_previous;
  // At the stamps of the previous pair and of this one.
  const Rates rates = {rateAt(kAround - 1), rateAt(kAround)};
  const Rates slow_rates = {slowRateAt(kAround - 1), slowRateAt(kAround)};
  std::vector<Shift> shifts;
  for (const Track& track : pair.tracks) {
    const Eigen::Vector3d before = camera.backProject(track.before.x(), track.before.y(), track.before.z());
    const auto residual = leftResidual(camera, T, before, track.now);
    if (!residual) continue;
    const auto& by_pose = residual->by_pose;
    Shift& shift = shifts.emplace_back();
    shift.residual = residual->value;
    shift.derivative.topRows<6>() = by_pose.transpose();
    for (const auto& [row, rate] : {std::pair(6, &rates), std::pair(7, &slow_rates)})
      shift.derivative.row(row) =
          shiftBy(*rate, camera, T.linear(), before, track.before.y(), track.now.y(), by_pose).transpose();
  }
  if (static_cast<int>(shifts.size()) < kFewestMeasured) return;

  // Cauchy's kernel around the pair's own fit of pose and readout. Around a fit of the pose alone, the largest shifts
  // would have the least weight. The instrument has no part in the fit.
  constexpr int kPasses = 2;  // (chosen)
  using Vector = Eigen::Matrix<double, 8, 1>;
  Vector fit = Vector::Zero(), by_residual;
  if (information_ > 0.0) fit[6] = product_ / information_;
  Eigen::Matrix<double, 8, 8> square;
  for (int pass = 0; pass < kPasses; ++pass) {
    square.setZero(), by_residual.setZero();
    for (const Shift& shift : shifts) {
      const Eigen::Vector2d left = shift.residual - shift.derivative.transpose() * fit;
      const double weight = cauchyWeight(left.squaredNorm() / kKernelSquare);
      square += weight * shift.derivative * shift.derivative.transpose();
      by_residual += weight * shift.derivative * shift.residual;
    }
    fit.head<7>() = square.topLeftCorner<7, 7>().ldlt().solve(by_residual.head<7>());
  }
  // Instrument * shift and instrument * residual, for the instrument less its regression on the pose.
  const Vector6d explained = square.topLeftCorner<6, 6>().ldlt().solve(square.topRightCorner<6, 1>());
  const double information = square(6, 7) - explained.dot(square.block<6, 1>(0, 6));
  const double product = by_residual[7] - explained.dot(by_residual.head<6>());
  if (!std::isfinite(information) || !std::isfinite(product)) return;
  constexpr double kMemory = RowDelay::kMemory, kForget = kMemory * kMemory;
  information_ = kMemory * information_ + information;
  product_ = kMemory * product_ + product;
  information_square_ = kForget * information_square_ + information * information;
  mixed_ = kForget * mixed_ + information * product;
  product_square_ = kForget * product_square_ + product * product;
}

std::optional<RowReadout::Estimate> RowReadout::estimate() const {
  // The readout itself biases the measured rates: rendered hand-held drives err by 0 to 6 % at 10 and 25 ms.
  constexpr double kModel = 0.05;  // ratio of the value
  if (!(information_ > 0.0)) return std::nullopt;
  const double value = product_ / information_;
  const double pairs = information_ * information_ / information_square_;  // effective number (Kish 1965)
  if (!(pairs > 1.0)) return std::nullopt;                                 // one pair has no spread
  const double spread = product_square_ - 2.0 * value * mixed_ + value * value * information_square_;
  // The spread of few pairs is uncertain: with this factor, kSquare is exceeded as rarely as with a known variance.
  // Wallace's approximation of Student's distribution: studentSquare().
  // Times the pairs, not the freedom: the spread around an estimated value is too small by their ratio.
  const double freedom = pairs - 1.0, correction = (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
  const double student = pairs * studentSquare(RowDelay::kSquare, freedom, correction) / RowDelay::kSquare;
  const double sigma = std::sqrt(std::max(spread, 0.0) * student) / information_;
  const Estimate estimate{value, std::hypot(sigma, kModel * value)};
  if (!(estimate.sigma < RowDelay::kFail)) return std::nullopt;
  return estimate;
}

/// Second moment of the readout around `compensated`, s^2: it is zero or, in a rolling shutter, of some milliseconds.
double RowReadout::squareAround(double compensated) const {
  constexpr double kRolling = 0.5, kReadout = 0.02;  // chosen: ratio of cameras; s, usual ones have 5 to 30 ms
  using Scalar = Eigen::Matrix<double, 1, 1>;
  constexpr double kExact = 1e-6;  // s (chosen): points of a simulator have no noise, and the sigma may be zero
  const auto known = estimate();
  const double value = known ? known->value : 0.0;
  const double sigma = known ? std::max(known->sigma, kExact) : std::numeric_limits<double>::infinity();
  const double information = 1.0 / (sigma * sigma);
  const double rolling = probabilityOf(
      logOdds(kRolling) + logBayesFactor<1>(Scalar(value), Scalar(information), Scalar(kReadout * kReadout)));
  const double variance = 1.0 / (information + 1.0 / (kReadout * kReadout));
  const double apart = variance * information * value - compensated;
  return (1.0 - rolling) * compensated * compensated + rolling * (variance + apart * apart);
}

Matrix6d RowReadout::momentOf(const StereoFeatures& features, const MotionHypothesis& found, double dt,
                              double compensated) const {
  if (pairs_.empty()) return Matrix6d::Zero();
  const StereoCamera& camera = features.camera;
  const Eigen::Isometry3d& T = found.motion.T_current_reference;
  const Eigen::Vector3d rate = logSO3(T.linear().transpose()) / dt, rate_before = pairs_.back().rate;
  const Rates rates = {0.5 * (rate_before + rate), velocityAfter(rate_before, rate)};
  constexpr std::size_t kMost = 64;  // (chosen) for a derivative
  const std::vector<Track> tracks = tracksOf(features, found, kMost);
  if (static_cast<int>(tracks.size()) < kFewestMeasured) return Matrix6d::Zero();
  Matrix6d information = Matrix6d::Zero();
  Vector6d product = Vector6d::Zero();
  for (const Track& track : tracks) {
    const Eigen::Vector3d before = camera.backProject(track.before.x(), track.before.y(), track.before.z());
    const auto residual = leftResidual(camera, T, before, track.now);
    if (!residual) continue;
    const auto& by_pose = residual->by_pose;
    const double weight = cauchyWeight(residual->value.squaredNorm() / kKernelSquare);
    information += weight * by_pose.transpose() * by_pose;
    product += weight * by_pose.transpose() *
               shiftBy(rates, camera, T.linear(), before, track.before.y(), track.now.y(), by_pose);
  }
  const Vector6d by_readout = information.ldlt().solve(product);
  if (!by_readout.allFinite()) return Matrix6d::Zero();
  return squareAround(compensated) * by_readout * by_readout.transpose();
}

}  // namespace sdvo
