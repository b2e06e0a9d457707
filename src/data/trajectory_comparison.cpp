#include "trajectory_comparison.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {
namespace {

constexpr std::int64_t kSecond = 1000000000;  // ns; also of a line, where lines stand for stamps
constexpr double kDegree = M_PI / 180.0;

/// Without stamps the number of a line stands for one.
StampedTrajectory byLines(StampedTrajectory file) {
  file.stamps.clear();
  for (std::size_t i = 0; i < file.poses.size(); ++i) file.stamps.push_back(static_cast<std::int64_t>(i) * kSecond);
  return file;
}

/// Differences between the stamps of an estimate and of its truth, ns.
class Shift {
 public:
  Shift(const StampedTrajectory& truth, const StampedTrajectory& estimate, bool in_lines)
      : truth_(truth), estimate_(estimate), in_lines_(in_lines) {
    std::vector<double> spacings;
    for (std::size_t i = 1; i < estimate.stamps.size(); ++i)
      spacings.push_back(static_cast<double>(estimate.stamps[i] - estimate.stamps[i - 1]));
    if (spacings.empty()) return;
    spacing_ = median(spacings);
    constexpr double kSpan = 0.2e9;           // ns (chosen): less is noise more than motion
    constexpr std::size_t kMostSteps = 400;  // for the time it takes
    const auto span =
        in_lines ? 1 : std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(kSpan / std::max(spacing_, 1.0))));
    const std::size_t stride = std::max(span, estimate.stamps.size() / kMostSteps);
    for (std::size_t i = 0; i + span < estimate.stamps.size(); i += stride)
      steps_.push_back({estimate.stamps[i], estimate.stamps[i + span],
                        logSE3(estimate.poses[i].inverse() * estimate.poses[i + span])});
  }

  /// The shift by which the motions agree, where it is significant; 0: none is.
  std::int64_t find() const {
    constexpr double kWide = 60e9;  // ns (chosen): more than clocks of GPS and UTC differ by
    constexpr std::int64_t kFewLines = 5, kCoarse = kSecond / 10, kFine = 1000000;
    const double unshifted = cost(0);
    std::vector<std::int64_t> candidates;
    if (in_lines_) {
      for (std::int64_t line = -kFewLines; line <= kFewLines; ++line) candidates.push_back(line * kSecond);
    } else {
      const bool is_apart = !std::isfinite(unshifted);
      const std::int64_t wide = static_cast<std::int64_t>(kWide);
      const std::int64_t from = is_apart ? truth_.stamps.front() - estimate_.stamps.back() : -wide;
      const std::int64_t to = is_apart ? truth_.stamps.back() - estimate_.stamps.front() : wide;
      for (std::int64_t shift = from; shift <= to; shift += kCoarse) candidates.push_back(shift);
    }
    std::int64_t best = 0;
    double least = unshifted;
    const auto tryShift = [&](std::int64_t shift) {
      const double now = cost(shift);
      if (!(now < least)) return;
      least = now;
      best = shift;
    };
    for (const std::int64_t candidate : candidates) tryShift(candidate);
    for (std::int64_t step = in_lines_ ? 0 : kCoarse / 2; step >= kFine; step /= 2)
      for (const std::int64_t around : {best - step, best + step}) tryShift(around);
    if (!std::isfinite(unshifted)) return std::isfinite(least) ? best : 0;
    constexpr double kMuch = 0.1, kProved = 30.0, kRelevant = 0.2;  // decrease of the log of the variances; spacings
    const double proved = std::max(kMuch, kProved / static_cast<double>(steps_.size()));
    return unshifted - least > proved && std::abs(static_cast<double>(best)) > kRelevant * spacing_ ? best : 0;
  }

  /// Poses at stamps that both have.
  std::pair<Trajectory, Trajectory> poses(std::int64_t shift) const {
    std::pair<Trajectory, Trajectory> both;
    for (std::size_t i = 0; i < estimate_.stamps.size(); ++i)
      if (const auto pose = poseAt(truth_, estimate_.stamps[i] + shift)) {
        both.first.push_back(*pose);
        both.second.push_back(estimate_.poses[i]);
      }
    return both;
  }

 private:
  struct Step {
    std::int64_t from, to;  ///< ns
    Vector6d motion;
  };

  /// Log of the variances of how far and how much the truth moves otherwise, which no constant transform changes;
  /// infinite where less than half of the steps are known, or few.
  double cost(std::int64_t shift) const {
    constexpr double kLeastLength = 1e-4, kLeastTurn = 1e-5;  // m, rad: digits of files
    constexpr std::size_t kFewest = 10;
    std::vector<double> lengths, turns;
    for (const Step& step : steps_) {
      const auto from = poseAt(truth_, step.from + shift), to = poseAt(truth_, step.to + shift);
      if (!from || !to) continue;
      const Vector6d motion = logSE3(from->inverse() * *to);
      lengths.push_back(motion.head<3>().norm() - step.motion.head<3>().norm());
      turns.push_back(motion.tail<3>().norm() - step.motion.tail<3>().norm());
    }
    if (lengths.size() < kFewest || 2 * lengths.size() < std::min(steps_.size(), truth_.stamps.size()))
      return std::numeric_limits<double>::infinity();
    const auto variance = [](const std::vector<double>& values, double least) {
      double sum = least * least;
      for (const double value : values) sum += value * value / static_cast<double>(values.size());
      return sum;
    };
    return std::log(variance(lengths, kLeastLength)) + std::log(variance(turns, kLeastTurn));
  }

  const StampedTrajectory &truth_, &estimate_;
  const bool in_lines_;
  double spacing_ = 0.0;  ///< of the estimate, ns
  std::vector<Step> steps_;
};

/// A motion of both bodies over the same time.
struct Motions {
  Eigen::Isometry3d of_truth, of_estimate;
};

using Motion6 = std::vector<Vector6d>;

/// How the motions differ if the truth's body has the pose `X` on the estimate's.
Motion6 residuals(const std::vector<Motions>& motions, const Eigen::Isometry3d& X) {
  Motion6 all;
  for (const Motions& m : motions) all.push_back(logSE3(m.of_truth.inverse() * (X.inverse() * m.of_estimate * X)));
  return all;
}

/// RMS of translations (m) and rotations (rad).
std::pair<double, double> spreadOf(const Motion6& residuals) {
  double translation = 1e-10, rotation = 1e-12;  // digits of files
  for (const Vector6d& r : residuals) {
    translation += r.head<3>().squaredNorm() / static_cast<double>(residuals.size());
    rotation += r.tail<3>().squaredNorm() / static_cast<double>(residuals.size());
  }
  return {std::sqrt(translation), std::sqrt(rotation)};
}

/// The pose of the truth's body on the estimate's one (hand-eye calibration), where it is proved; none: identity.
std::optional<Eigen::Isometry3d> bodyTransform(const Trajectory& truth, const Trajectory& estimate) {
  constexpr std::size_t kSpans = 200, kFewest = 10;
  std::vector<Motions> motions;
  const std::size_t span = std::max<std::size_t>(1, truth.size() / kSpans);
  for (std::size_t i = 0; i + span < truth.size(); i += span)
    motions.push_back({truth[i].inverse() * truth[i + span], estimate[i].inverse() * estimate[i + span]});
  if (motions.size() < kFewest) return std::nullopt;
  std::vector<double> scales;  // an error of the estimate, which would look like a lever
  for (const Motions& m : motions)
    if (const double length = m.of_estimate.translation().norm(); length > 0.0)
      scales.push_back(m.of_truth.translation().norm() / length);
  const double scale = scales.empty() ? 1.0 : median(scales);
  for (Motions& m : motions) m.of_estimate.translation() *= scale;

  // Rotation vectors and, if the lever is short, translations are turned alike.
  const Motion6 of_truth = [&] {
    Motion6 all;
    for (const Motions& m : motions) all.push_back(logSE3(m.of_truth));
    return all;
  }();
  const auto [length, turn] = spreadOf(of_truth);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const Vector6d other = logSE3(motions[i].of_estimate);
    sum += other.head<3>() * of_truth[i].head<3>().transpose() / (length * length) +
           other.tail<3>() * of_truth[i].tail<3>().transpose() / (turn * turn);
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  X.linear() = svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();

  constexpr int kPasses = 10;
  constexpr double kStep = 1e-6, kUsual = 1.0;  // m or rad; m, standard deviation of levers beforehand
  Matrix6d information;
  for (int pass = 0; pass < kPasses; ++pass) {
    const Motion6 now = residuals(motions, X);
    const auto [translation, rotation] = spreadOf(now);
    Vector6d weights;
    weights << Eigen::Vector3d::Constant(1.0 / translation), Eigen::Vector3d::Constant(1.0 / rotation);
    std::vector<Matrix6d> jacobians(motions.size());
    for (int axis = 0; axis < 6; ++axis) {
      const Motion6 moved = residuals(motions, X * expSE3(kStep * Vector6d::Unit(axis)));
      for (std::size_t i = 0; i < moved.size(); ++i) jacobians[i].col(axis) = (moved[i] - now[i]) / kStep;
    }
    information = Matrix6d::Zero();
    information.topLeftCorner<3, 3>().diagonal().setConstant(1.0 / (kUsual * kUsual));
    information.bottomRightCorner<3, 3>().diagonal().setConstant(1.0);  // rad: about the axis of all motions
    Vector6d gradient = Vector6d::Zero();
    for (std::size_t i = 0; i < motions.size(); ++i) {
      const Matrix6d weighted = weights.asDiagonal() * jacobians[i];
      information += weighted.transpose() * weighted / 3.0;
      gradient -= weighted.transpose() * weights.cwiseProduct(now[i]) / 3.0;
    }
    gradient.head<3>() -= X.linear().transpose() * X.translation() / (kUsual * kUsual);
    X = X * expSE3(Vector6d(information.ldlt().solve(gradient)));
  }
  constexpr double kTurned = 0.5 * kDegree, kLever = 0.02, kProved = 25.0;  // rad, m, chi square
  const double least = std::max(0.3, 30.0 / static_cast<double>(motions.size()));  // of the logs of the spreads (chosen)
  const Matrix6d covariance = information.ldlt().solve(Matrix6d::Identity());
  const Eigen::Vector3d lever = X.translation(), in_body = X.linear().transpose() * lever;
  const Eigen::Matrix3d of_lever = covariance.topLeftCorner<3, 3>();
  const bool has_lever = lever.norm() > kLever && in_body.dot(of_lever.ldlt().solve(in_body)) > kProved;
  if (!has_lever) X.translation().setZero();
  const auto before = spreadOf(residuals(motions, Eigen::Isometry3d::Identity())), after = spreadOf(residuals(motions, X));
  const double better = std::log(before.first / after.first) + std::log(before.second / after.second);
  if (better < least || (!has_lever && Eigen::AngleAxisd(X.linear()).angle() < kTurned)) return std::nullopt;
  return X;
}

/// Rotation from the estimate's world to the truth's.
Eigen::Matrix3d worldRotation(const Trajectory& truth, const Trajectory& estimate) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < truth.size(); ++i) sum += truth[i].linear() * estimate[i].linear().transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d R = svd.matrixU() * svd.matrixV().transpose();
  return R.determinant() > 0.0 ? R : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

std::string spanOf(const StampedTrajectory& file) {
  return text(3, 1e-9 * static_cast<double>(file.stamps.front()), " to ",
              1e-9 * static_cast<double>(file.stamps.back()), " s");
}

}  // namespace

TrajectoryComparison compareTrajectories(const std::string& ground_truth, const std::string& estimate,
                                         const ComparisonOptions& options) {
  StampedTrajectory truth = readPoses(ground_truth), estimated = readPoses(estimate);
  TrajectoryComparison comparison;
  std::vector<std::string>& differences = comparison.differences;
  for (const StampedTrajectory* file : {&truth, &estimated})
    for (const std::string& remark : file->remarks) differences.push_back(remark);
  const bool in_lines = truth.stamps.empty() || estimated.stamps.empty();
  if (in_lines) {
    if (truth.stamps.empty() != estimated.stamps.empty() && truth.poses.size() != estimated.poses.size())
      throw std::runtime_error(text(0, "'", ground_truth, "' has ", truth.poses.size(), " poses, '", estimate, "' ",
                                    estimated.poses.size(),
                                    ", and one of both has no stamps: run_sequence writes either by --format kitti or tum"));
    if (options.offset) throw std::runtime_error("--offset in s needs stamps in both files");
    if (estimated.poses.size() > truth.poses.size())
      throw std::invalid_argument(text(0, "the estimated trajectory has ", estimated.poses.size(),
                                       " poses, more than the ", truth.poses.size(),
                                       " of the ground truth: do they belong to the same sequence?"));
    truth = byLines(std::move(truth));
    estimated = byLines(std::move(estimated));
  }
  const Shift shift(truth, estimated, in_lines);
  std::int64_t given = options.offset ? std::llround(1e9 * *options.offset) : 0;
  const std::int64_t found = options.offset ? given : shift.find();
  const bool is_applied = options.find_offset && found != 0;
  if (is_applied) given = found;
  if (found != 0 && !options.offset) {
    const double amount = 1e-9 * static_cast<double>(found);
    const std::string what =
        in_lines ? text(0, "lines are shifted: line 1 of the estimate belongs to line ", 1.0 + amount, " of the truth")
                 : text(3, "clocks are shifted: the estimate's stamps lack ", amount, " s of the truth's");
    differences.push_back(what + (is_applied ? ", which --offset auto corrects" : ": --offset auto corrects it"));
  }
  std::tie(comparison.truth, comparison.estimate) = shift.poses(given);
  if (comparison.truth.size() < 2 && estimated.poses.size() >= 2)
    throw std::runtime_error("no poses belong together: stamps of '" + ground_truth + "' are " + spanOf(truth) +
                             ", those of '" + estimate + "' " + spanOf(estimated) +
                             (found != 0 ? "; " + differences.back() : ": are they of one drive, in s or ns?"));
  const auto& [of_truth, of_estimate] = found != given ? shift.poses(found) : std::pair(comparison.truth, comparison.estimate);
  const auto X = bodyTransform(of_truth, of_estimate);
  if (X) {
    const Eigen::Vector3d t = X->translation(), turn = logSO3(X->linear()) / kDegree;
    differences.push_back(text(3, "bodies differ: the truth's is at ", t.x(), " ", t.y(), " ", t.z(),
                               " m on the estimate's, turned by ") +
                          text(2, turn.norm(), " deg (rotation vector ", turn.x(), " ", turn.y(), " ", turn.z(), ")") +
                          (options.align ? ", which --align corrects" : ": --align corrects it"));
  }
  Trajectory moved = of_estimate;
  for (Eigen::Isometry3d& pose : moved) pose = pose * X.value_or(Eigen::Isometry3d::Identity());
  const double world = of_truth.empty() ? 0.0 : Eigen::AngleAxisd(worldRotation(of_truth, moved)).angle();
  constexpr double kTurned = 5.0 * kDegree;  // more than drift
  if (world > kTurned)
    differences.push_back(text(1, "worlds differ: the truth's is turned by ", world / kDegree,
                               " deg, which no figure below counts"));
  if (X && options.align)
    for (Eigen::Isometry3d& pose : comparison.estimate) pose = pose * *X;
  return comparison;
}

}  // namespace sdvo
