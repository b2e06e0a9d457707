#include "stereo_descriptor_vo/data/trajectory.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "text_file.hpp"

namespace sdvo {
namespace {

constexpr double kDegreesPerRadian = 180.0 / M_PI;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Rounding that a sub-path may lack of its length.
constexpr double kLengthTolerance = 1e-9;  // m

/// Shorter steps are left out of the scale: the robot stands.
constexpr double kSmallestStep = 1e-3;  // m

/// Tolerance on rows of rotations and quaternions in files, which may have been written with four decimals.
constexpr double kRotationTolerance = 1e-3;

double rotationAngle(const Eigen::Matrix3d& rotation) {
  // The quaternion keeps full precision for small angles, where the devkit's acos of the trace loses half of the
  // digits.
  return Eigen::Quaterniond(rotation).angularDistance(Eigen::Quaterniond::Identity());
}

/// Error of the motion between two frames, in the frame of the true later pose.
Eigen::Isometry3d motionError(const Trajectory& ground_truth, const Trajectory& estimate, std::size_t first,
                              std::size_t last) {
  const Eigen::Isometry3d true_motion = ground_truth[first].inverse() * ground_truth[last];
  const Eigen::Isometry3d estimated_motion = estimate[first].inverse() * estimate[last];
  return true_motion.inverse() * estimated_motion;
}

/// The ground truth of the frames that the estimate covers.
Trajectory covered(const Trajectory& ground_truth, const Trajectory& estimate) {
  if (estimate.empty()) throw std::invalid_argument("the estimated trajectory has no poses");
  if (estimate.size() > ground_truth.size())
    throw std::invalid_argument(text(0, "the estimated trajectory has ", estimate.size(), " poses, more than the ",
                                     ground_truth.size(),
                                     " of the ground truth: do they belong to the same sequence?"));
  return {ground_truth.begin(), ground_truth.begin() + static_cast<std::ptrdiff_t>(estimate.size())};
}

Eigen::Matrix3Xd positions(const Trajectory& poses) {
  Eigen::Matrix3Xd result(3, poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) result.col(static_cast<Eigen::Index>(i)) = poses[i].translation();
  return result;
}

double rootMeanSquareDistance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return std::sqrt((a - b).squaredNorm() / static_cast<double>(a.cols()));
}

double scaleOfSteps(const Trajectory& ground_truth, const Trajectory& estimate) {
  std::vector<double> ratios;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    const double true_step = (ground_truth[i].translation() - ground_truth[i - 1].translation()).norm();
    if (true_step < kSmallestStep) continue;
    ratios.push_back((estimate[i].translation() - estimate[i - 1].translation()).norm() / true_step);
  }
  return ratios.empty() ? kNaN : median(ratios);
}

/// Throws std::invalid_argument if the quaternion has not unit length.
Eigen::Isometry3d poseOf(const std::vector<double>& position, const Eigen::Quaterniond& rotation) {
  if (std::abs(rotation.norm() - 1.0) > kRotationTolerance)
    throw std::invalid_argument("the quaternion is not of unit length");
  return Eigen::Translation3d(position[0], position[1], position[2]) * rotation.normalized();
}

/// A format of poses in lines of numbers. `read` gets the numbers after the stamp, if there is one.
struct PoseFormat {
  const char* name;
  std::size_t numbers;  ///< of a line, at least
  std::int64_t (*stamp)(const std::string& word);
  Eigen::Isometry3d (*read)(const std::vector<double>& numbers);
};

Eigen::Isometry3d poseFromTwelve(const std::vector<double>& n) {
  std::array<double, 12> rows;
  std::copy(n.begin(), n.end(), rows.begin());
  return poseFromRows(rows);
}

const PoseFormat kKitti = {"KITTI's (12 numbers a line)", 12, nullptr, poseFromTwelve};
const PoseFormat kStampedKitti = {"KITTI's behind a stamp in ns", 13, parseNanoseconds, poseFromTwelve};
const PoseFormat kTum = {"TUM's (stamp in s, x y z, qx qy qz qw)", 8, parseSeconds, [](const std::vector<double>& n) {
                           return poseOf(n, {n[6], n[3], n[4], n[5]});
                         }};
const PoseFormat kEuroc = {"EuRoC's (stamp in ns, x, y, z, qw, qx, qy, qz, …)", 8, parseNanoseconds,
                           [](const std::vector<double>& n) {
                             return poseOf(n, {n[3], n[4], n[5], n[6]});
                           }};

/// The format that the first line of poses shows.
const PoseFormat& formatOf(const std::string& line) {
  const std::size_t numbers = splitWords(line).size();
  if (line.find(',') < line.find_first_of(" \t") && std::count(line.begin(), line.end(), ',') >= 7) return kEuroc;
  for (const PoseFormat* format : {&kKitti, &kStampedKitti, &kTum})
    if (numbers == format->numbers) return *format;
  throw std::invalid_argument(
      text(0, numbers, " numbers: poses are ", kKitti.name, ", ", kTum.name, " or ", kEuroc.name));
}

/// `wanted`: the only format accepted; null: any.
StampedTrajectory readPosesAs(const std::string& path, const PoseFormat* wanted) {
  StampedTrajectory trajectory;
  const PoseFormat* format = nullptr;
  readLines(path, true, [&](std::string line) {
    if (!format) {
      format = &formatOf(line);
      if (wanted && format != wanted)
        throw std::invalid_argument("poses in " + std::string(format->name) + " format, expected " + wanted->name);
    }
    if (format == &kEuroc) std::replace(line.begin(), line.end(), ',', ' ');
    const std::vector<std::string> words = splitWords(line);
    if (words.size() < format->numbers || (words.size() > format->numbers && format != &kEuroc))
      throw std::invalid_argument(text(0, "expected ", format->numbers, " numbers, found ", words.size()));
    if (format->stamp) {
      const std::int64_t stamp = format->stamp(words.front());
      if (!trajectory.stamps.empty() && stamp <= trajectory.stamps.back())
        throw std::invalid_argument("stamp " + words.front() + " is not later than the one before");
      trajectory.stamps.push_back(stamp);
    }
    std::vector<double> numbers;
    std::transform(words.begin() + (format->stamp ? 1 : 0),
                   words.begin() + static_cast<std::ptrdiff_t>(format->numbers), std::back_inserter(numbers),
                   parseNumber<double>);
    trajectory.poses.push_back(format->read(numbers));
  });
  if (!format) throw std::runtime_error("file '" + path + "' contains no poses");
  return trajectory;
}

/// Poses further apart than this (ns) are not interpolated: the motion between them may be anything.
constexpr std::int64_t kLongestGap = 500000000;

std::optional<Eigen::Isometry3d> interpolated(const StampedTrajectory& truth, std::int64_t stamp) {
  const auto next = std::lower_bound(truth.stamps.begin(), truth.stamps.end(), stamp);
  if (next == truth.stamps.end()) return std::nullopt;
  const auto after = static_cast<std::size_t>(std::distance(truth.stamps.begin(), next));
  if (*next == stamp) return truth.poses[after];
  if (after == 0 || *next - truth.stamps[after - 1] > kLongestGap) return std::nullopt;
  const Eigen::Isometry3d &from = truth.poses[after - 1], &to = truth.poses[after];
  const double part =
      static_cast<double>(stamp - truth.stamps[after - 1]) / static_cast<double>(*next - truth.stamps[after - 1]);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(from.linear()).slerp(part, Eigen::Quaterniond(to.linear())).toRotationMatrix();
  pose.translation() = (1.0 - part) * from.translation() + part * to.translation();
  return pose;
}

}  // namespace

Eigen::Isometry3d poseFromRows(const std::array<double, 12>& rows) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(rows.data());
  if (!matrix.allFinite()) throw std::invalid_argument("the pose is not finite");
  const Eigen::Matrix3d written = matrix.leftCols<3>();
  const double deviation = (written * written.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (deviation > kRotationTolerance || written.determinant() < 0.0)
    throw std::invalid_argument("the left 3x3 part of the pose is not a rotation");
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(written, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = svd.matrixU() * svd.matrixV().transpose();
  pose.translation() = matrix.col(3);
  return pose;
}

StampedTrajectory readPoses(const std::string& path) {
  return readPosesAs(path, nullptr);
}

Trajectory readKittiPoses(const std::string& path) {
  return readPosesAs(path, &kKitti).poses;
}

void writeKittiPoses(const std::string& path, const Trajectory& poses) {
  std::ostringstream file = numberStream();
  for (const Eigen::Isometry3d& pose : poses) {
    for (int i = 0; i < 12; ++i) file << pose.matrix()(i / 4, i % 4) << (i == 11 ? '\n' : ' ');
  }
  writeTextFile(path, file.str());
}

void writeTumPoses(const std::string& path, const StampedTrajectory& trajectory) {
  if (trajectory.stamps.size() != trajectory.poses.size())
    throw std::invalid_argument(
        text(0, "a trajectory with ", trajectory.poses.size(), " poses has ", trajectory.stamps.size(), " stamps"));
  std::ostringstream file = numberStream();
  file << "# stamp[s] tx ty tz qx qy qz qw\n";
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    const Eigen::Vector3d t = trajectory.poses[i].translation();
    const Eigen::Quaterniond q = Eigen::Quaterniond(trajectory.poses[i].linear()).normalized();
    file << formatSeconds(trajectory.stamps[i]) << ' ' << t.x() << ' ' << t.y() << ' ' << t.z() << ' ' << q.x() << ' '
         << q.y() << ' ' << q.z() << ' ' << q.w() << '\n';
  }
  writeTextFile(path, file.str());
}

std::vector<double> kittiLengths() {
  return {100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0};
}

std::vector<double> distancesTravelled(const Trajectory& poses) {
  std::vector<double> distances(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    distances[i] = distances[i - 1] + (poses[i].translation() - poses[i - 1].translation()).norm();
  }
  return distances;
}

std::vector<SubPathErrors> subPathErrors(const Trajectory& ground_truth, const Trajectory& estimate,
                                         const std::vector<double>& lengths) {
  const std::vector<double> distances = distancesTravelled(covered(ground_truth, estimate));
  const auto divide = [](SubPathErrors& sums) {
    const double count = sums.count > 0 ? sums.count : kNaN;
    sums.translation_percent /= count;
    sums.rotation_deg_per_m /= count;
  };

  SubPathErrors all;
  std::vector<SubPathErrors> result;
  for (const double length : lengths) {
    if (!(std::isfinite(length) && length > 0.0)) {
      throw std::invalid_argument("sub-path length " + std::to_string(length) + " m must be positive");
    }
    SubPathErrors sums;
    sums.length = length;
    for (std::size_t first = 0; first < distances.size(); ++first) {
      const auto end =
          std::lower_bound(distances.begin(), distances.end(), distances[first] + length - kLengthTolerance);
      if (end == distances.end()) break;
      const std::size_t last = static_cast<std::size_t>(end - distances.begin());
      const Eigen::Isometry3d error = motionError(ground_truth, estimate, first, last);
      sums.translation_percent += 100.0 * error.translation().norm() / length;
      sums.rotation_deg_per_m += kDegreesPerRadian * rotationAngle(error.linear()) / length;
      ++sums.count;
    }
    all.count += sums.count;
    all.translation_percent += sums.translation_percent;
    all.rotation_deg_per_m += sums.rotation_deg_per_m;
    divide(sums);
    result.push_back(sums);
  }
  divide(all);
  result.push_back(all);
  return result;
}

TrajectoryErrors evaluateTrajectory(const Trajectory& ground_truth, const Trajectory& estimate,
                                    const std::vector<double>& lengths) {
  const Trajectory truth = covered(ground_truth, estimate);
  TrajectoryErrors errors;
  errors.frames = static_cast<int>(estimate.size());
  errors.path_length = distancesTravelled(truth).back();
  errors.per_length = subPathErrors(truth, estimate, lengths);
  errors.sub_paths = errors.per_length.back();
  errors.per_length.pop_back();

  const double steps = estimate.size() > 1 ? static_cast<double>(estimate.size() - 1) : kNaN;
  double squared_translation = 0.0;
  double squared_rotation = 0.0;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    const Eigen::Isometry3d error = motionError(truth, estimate, i - 1, i);
    squared_translation += error.translation().squaredNorm();
    squared_rotation += std::pow(kDegreesPerRadian * rotationAngle(error.linear()), 2);
  }
  errors.rpe_translation_m = std::sqrt(squared_translation / steps);
  errors.rpe_rotation_deg = std::sqrt(squared_rotation / steps);

  const Eigen::Matrix3Xd true_positions = positions(truth);
  const Eigen::Matrix3Xd estimated_positions = positions(estimate);
  const auto moved = [&](const Eigen::Isometry3d& T_truth_estimate) -> Eigen::Matrix3Xd {
    return (T_truth_estimate.linear() * estimated_positions).colwise() + T_truth_estimate.translation();
  };
  const Eigen::Isometry3d best(Eigen::umeyama(estimated_positions, true_positions, false));
  errors.ate_aligned_m = rootMeanSquareDistance(moved(best), true_positions);
  const Eigen::Matrix3Xd from_first = moved(truth.front() * estimate.front().inverse());
  errors.ate_first_pose_m = rootMeanSquareDistance(from_first, true_positions);
  errors.final_drift_m = (from_first.rightCols<1>() - true_positions.rightCols<1>()).norm();
  errors.final_drift_percent = errors.path_length > 0.0 ? 100.0 * errors.final_drift_m / errors.path_length : kNaN;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const Eigen::Isometry3d error = motionError(truth, estimate, 0, i);
    errors.final_drift_deg = kDegreesPerRadian * rotationAngle(error.linear());
    errors.largest_drift_m = std::max(errors.largest_drift_m, error.translation().norm());
    errors.largest_drift_deg = std::max(errors.largest_drift_deg, errors.final_drift_deg);
  }
  errors.scale = scaleOfSteps(truth, estimate);
  return errors;
}

std::vector<std::optional<Eigen::Isometry3d>> readGroundTruth(const std::string& path,
                                                              const std::vector<std::int64_t>& stamps) {
  const StampedTrajectory truth = readPoses(path);
  if (truth.stamps.empty()) {
    if (truth.poses.size() < stamps.size())
      throw std::runtime_error(text(0, "file '", path, "' has ", truth.poses.size(), " poses for ", stamps.size(),
                                    " pairs: one line for each is needed, or stamps as in ", kTum.name, " format"));
    return {truth.poses.begin(), truth.poses.begin() + static_cast<std::ptrdiff_t>(stamps.size())};
  }
  std::vector<std::optional<Eigen::Isometry3d>> poses;
  for (const std::int64_t stamp : stamps) poses.push_back(interpolated(truth, stamp));
  if (std::count_if(poses.begin(), poses.end(), [](const auto& pose) { return pose.has_value(); }) < 2)
    throw std::runtime_error("file '" + path + "' has no poses at the stamps of the recording");
  return poses;
}

std::pair<Trajectory, Trajectory> readComparable(const std::string& ground_truth, const std::string& estimate) {
  const StampedTrajectory truth = readPoses(ground_truth), estimated = readPoses(estimate);
  if (truth.stamps.empty() || estimated.stamps.empty()) {
    // Without stamps in both files poses correspond by their lines.
    if (truth.stamps.empty() != estimated.stamps.empty() && truth.poses.size() != estimated.poses.size())
      throw std::runtime_error(
          text(0, "'", ground_truth, "' has ", truth.poses.size(), " poses, '", estimate, "' ", estimated.poses.size(),
               ", and one of both has no stamps: run_sequence writes either by --format kitti or tum"));
    return {truth.poses, estimated.poses};
  }
  std::pair<Trajectory, Trajectory> both;
  const auto truths = readGroundTruth(ground_truth, estimated.stamps);
  for (std::size_t i = 0; i < truths.size(); ++i) {
    if (!truths[i]) continue;
    both.first.push_back(*truths[i]);
    both.second.push_back(estimated.poses[i]);
  }
  return both;
}

}  // namespace sdvo
