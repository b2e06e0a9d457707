#include "row_readout.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>

#include "../motion/noise.hpp"
#include "../motion/pose_problem.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {
namespace {

constexpr std::size_t kAround = 4;  // pairs before and after one, whose mean rates give the slow rate there

/// How a feature's position (u_left, v_left), px, depends on the pose and on the readout. A readout of 1 s shifts it by
/// the camera's rate of rotation (last column of the Jacobian). The same shift by the slow rate is the instrument.
struct Shift {
  Eigen::Matrix<double, 2, 7> by_pose_and_rate;
  Eigen::Vector2d by_slow_rate, residual;
};

}  // namespace

/// The features that the previous pair has, too. The flow has the map's position there, which is a mean over pairs: the
/// nearest feature is taken instead.
std::vector<RowReadout::Seen> RowReadout::seenBefore(const StereoFeatures& features,
                                                     const OdometryResult& result) const {
  constexpr float kNear = 2.f;  // px (chosen): more than the map's positions err
  std::vector<Seen> seen;
  for (const FeatureFlow& flow : result.flow) {
    float least = kNear * kNear;
    std::size_t nearest = us_.size();
    for (std::size_t k = 0; k < us_.size(); ++k) {
      const float du = us_[k] - flow.u_previous, dv = vs_[k] - flow.v_previous, square = du * du + dv * dv;
      if (square < least) least = square, nearest = k;
    }
    if (nearest == us_.size()) continue;
    seen.push_back(
        {{us_[nearest], vs_[nearest], flow.disparity_previous}, {features.u[flow.current], features.v[flow.current]}});
  }
  return seen;
}

void RowReadout::add(const StereoFeatures& features, const OdometryResult& result) {
  constexpr double kSteady = 0.3;  // ratio (chosen) by which intervals may differ
  const bool is_measured = result.has_motion && result.inliers >= kFewestMeasured && result.dt > 0.0;
  const bool continues =
      is_measured && (pairs_.empty() || std::abs(result.dt - pairs_.back().dt) < kSteady * pairs_.back().dt);
  if (!continues) pairs_.clear();
  if (is_measured)
    pairs_.push_back({features.camera, seenBefore(features, result), result.T_previous_current.inverse(), result.dt,
                      logSO3(result.T_previous_current.linear()) / result.dt});
  us_ = features.u, vs_ = features.v;
  if (pairs_.size() <= 2 * kAround) return;
  measure();
  pairs_.pop_front();
}

/// Adds the middle one of the pairs to the sums.
void RowReadout::measure() {
  // The rate at a pair from the means before and after it (Colella and Woodward 1984), and its binomial mean over five.
  const auto rateAt = [&](std::size_t k) -> Eigen::Vector3d {
    return (7.0 * (pairs_[k].rate + pairs_[k + 1].rate) - pairs_[k - 1].rate - pairs_[k + 2].rate) / 12.0;
  };
  const auto slowRateAt = [&](std::size_t k) -> Eigen::Vector3d {
    return (rateAt(k - 2) + 4.0 * rateAt(k - 1) + 6.0 * rateAt(k) + 4.0 * rateAt(k + 1) + rateAt(k + 2)) / 16.0;
  };
  const Pair& pair = pairs_[kAround];
  const StereoCamera& camera = pair.camera;
  const Eigen::Isometry3d& T = pair.T_current_previous;
  const std::array<Eigen::Vector3d, 2> rates = {rateAt(kAround - 1), rateAt(kAround)};
  const std::array<Eigen::Vector3d, 2> slow_rates = {slowRateAt(kAround - 1), slowRateAt(kAround)};
  const auto timeOf = [&](double v) { return (v + 0.5) / camera.height - 0.5; };  // in readouts, after the stamp
  std::vector<Shift> shifts;
  for (const Seen& seen : pair.seen) {
    const Eigen::Vector3d before = camera.backProject(seen.before.x(), seen.before.y(), seen.before.z());
    const Eigen::Vector3d now = T * before;
    if (!(now.z() > camera.nearestDepth())) continue;
    const Eigen::Matrix<double, 2, 6> by_pose = motionJacobian(camera, T, before).topRows<2>();
    const auto shiftBy = [&](const std::array<Eigen::Vector3d, 2>& rate) -> Eigen::Vector2d {
      const Eigen::Vector3d moved = T.linear() * rate[0].cross(before);
      return timeOf(seen.before.y()) * by_pose.leftCols<3>() * moved -
             timeOf(seen.now.y()) * by_pose.rightCols<3>() * rate[1];
    };
    Shift& shift = shifts.emplace_back();
    shift.by_pose_and_rate << by_pose, shiftBy(rates);
    shift.by_slow_rate = shiftBy(slow_rates);
    shift.residual = seen.now - camera.project(now).head<2>();
  }
  if (static_cast<int>(shifts.size()) < kFewestMeasured) return;

  // Cauchy's kernel around the pair's own fit, which has the readout: else the largest shifts would weigh least.
  constexpr int kReweightings = 4;  // (chosen)
  const double corner = NoiseOptions().corner, bend = noiseGate(2) * corner * corner;
  using Vector = Eigen::Matrix<double, 7, 1>;
  using Matrix = Eigen::Matrix<double, 7, 7>;
  Vector fit = Vector::Zero(), by_rest, by_slow_rate;
  Matrix square;
  double rest = 0.0;
  for (int pass = 0; pass <= kReweightings; ++pass) {
    square.setZero(), by_rest.setZero(), by_slow_rate.setZero(), rest = 0.0;
    for (const Shift& shift : shifts) {
      const auto& jacobian = shift.by_pose_and_rate;
      const double weight = pass == 0 ? 1.0 / bend : 1.0 / (bend + (shift.residual - jacobian * fit).squaredNorm());
      square += weight * jacobian.transpose() * jacobian;
      by_rest += weight * jacobian.transpose() * shift.residual;
      by_slow_rate += weight * jacobian.transpose() * shift.by_slow_rate;
      rest += weight * shift.by_slow_rate.dot(shift.residual);
    }
    fit = square.ldlt().solve(by_rest);
  }
  // Product of instrument and shift, and of instrument and residual, without what the pose explains of them.
  const Vector6d explained = square.topLeftCorner<6, 6>().ldlt().solve(by_slow_rate.head<6>());
  const double information = by_slow_rate[6] - explained.dot(square.topRightCorner<6, 1>());
  const double product = rest - explained.dot(by_rest.head<6>());
  if (!std::isfinite(information) || !std::isfinite(product)) return;
  constexpr double kMemory = RowDelay::kMemory, kForget = kMemory * kMemory;
  information_ = kMemory * information_ + information;
  product_ = kMemory * product_ + product;
  information_square_ = kForget * information_square_ + information * information;
  mixed_ = kForget * mixed_ + information * product;
  product_square_ = kForget * product_square_ + product * product;
  measured_ = kMemory * measured_ + 1.0;
}

std::optional<RowReadout::Estimate> RowReadout::estimate() const {
  // Rates that the readout itself biases: drives that follow hand_held 921 and 922 err by 0 to 6 % at 10 and 25 ms.
  constexpr double kModel = 0.05;  // ratio of the value
  if (measured_ < kFewestMeasured || !(information_ > 0.0)) return std::nullopt;
  const double value = product_ / information_;
  const double spread = product_square_ - 2.0 * value * mixed_ + value * value * information_square_;
  const Estimate estimate{value, std::hypot(std::sqrt(std::max(spread, 0.0)) / information_, kModel * value)};
  if (!(estimate.sigma < RowDelay::kFail)) return std::nullopt;
  return estimate;
}

}  // namespace sdvo
