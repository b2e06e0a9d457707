#include "stereo_descriptor_vo/data/trajectory.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "text_file.hpp"

namespace sdvo {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Rounding that a sub-path may lack of its length.
constexpr double kLengthTolerance = 1e-9;  // m

/// Shorter steps are left out of the scale: the robot stands.
constexpr double kSmallestStep = 1e-3;  // m

/// Tolerance on rows of rotations and quaternions in files, which may have been written with four decimals.
constexpr double kRotationTolerance = 1e-3;

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
Eigen::Isometry3d poseOf(const std::vector<double>& n, int w) {
  const std::size_t x = w == 3 ? 4 : 3;
  const Eigen::Quaterniond rotation(n[static_cast<std::size_t>(w)], n[x], n[x + 1], n[x + 2]);
  if (std::abs(rotation.norm() - 1.0) > kRotationTolerance)
    throw std::invalid_argument("the quaternion is not of unit length");
  return Eigen::Translation3d(n[0], n[1], n[2]) * rotation.normalized();
}

Eigen::Isometry3d poseFromTwelve(const std::vector<double>& n) {
  std::array<double, 12> rows;
  std::copy(n.begin(), n.end(), rows.begin());
  return poseFromRows(rows);
}

/// Of a body with x ahead, y to the right, z down, to the camera on it.
Eigen::Isometry3d poseFromNed(const std::vector<double>& n) {
  Eigen::Isometry3d T_body_camera = Eigen::Isometry3d::Identity();
  T_body_camera.linear() << 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
  return poseOf(n, 6) * T_body_camera;
}

/// A format of poses in lines of numbers. `read` gets the numbers after the stamp, if there is one.
struct PoseFormat {
  const char* name;
  std::size_t numbers;  ///< of a line, with the stamp
  bool has_stamp;
  Eigen::Isometry3d (*read)(const std::vector<double>& numbers);
};

const PoseFormat kKitti = {"KITTI's (12 numbers a line)", 12, false, poseFromTwelve};
const PoseFormat kTum = {"TUM's (stamp, x y z, qx qy qz qw)", 8, true,
                         [](const std::vector<double>& n) { return poseOf(n, 6); }};
const PoseFormat kEuroc = {"EuRoC's (CSV: stamp in ns, x, y, z, qw, qx, qy, qz, …)", 8, true,
                           [](const std::vector<double>& n) { return poseOf(n, 3); }};
const PoseFormat kStampedKitti = {"KITTI's behind a stamp in ns", 13, true, poseFromTwelve};
const PoseFormat kFormats[] = {kKitti,
                               kStampedKitti,
                               kTum,
                               {"TartanAir's (x y z, qx qy qz qw)", 7, false, poseFromNed},
                               kEuroc};

/// A table of numbers with the names of its columns, if it has any.
class PoseTable {
 public:
  explicit PoseTable(const std::string& line) {
    is_csv_ = std::count(line.begin(), line.end(), ',') >= 6 || std::count(line.begin(), line.end(), ';') >= 6;
  }

  std::vector<std::string> wordsOf(std::string line) const {
    if (is_csv_) std::replace_if(line.begin(), line.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
    return splitWords(line);
  }

  /// From a head line, such as "timestamp [ns], p_x [m], …, q_w []" or "field.pose.position.x". Columns of a position
  /// and a quaternion are found by the last letter of their names.
  static std::vector<std::size_t> columnsOf(const std::string& head) {
    std::vector<std::string> names(1);
    for (const char c : head)
      if (c == ',' || c == ';' || (head.find(',') == std::string::npos && std::isspace(static_cast<unsigned char>(c))))
        names.emplace_back();
      else
        names.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    std::vector<std::size_t> columns = {0};
    for (const char* wanted : {"px", "py", "pz", "qx", "qy", "qz", "qw"})
      for (std::size_t i = 0; i < names.size(); ++i) {
        std::string name = names[i].substr(0, names[i].find('['));
        name.erase(name.find_last_not_of(" \t\r") + 1);
        const bool turns = name.find('q') != std::string::npos || name.find("orientation") != std::string::npos;
        if (name.empty() || name.back() != wanted[1] || turns != (wanted[0] == 'q')) continue;
        columns.push_back(i);
        break;
      }
    return columns.size() == 8 ? columns : std::vector<std::size_t>();
  }

  const PoseFormat& formatOf(const std::vector<std::string>& words) const {
    // Without a head, stamps in ns tell EuRoC's CSV from TUM's.
    if (is_csv_ && words.size() >= 8 && words[0].find('.') == std::string::npos &&
        (words.size() > 8 || words[0].size() > 15))
      return kEuroc;
    for (const PoseFormat& format : kFormats)
      if (words.size() == format.numbers) return format;
    std::string known;
    for (const PoseFormat& format : kFormats) known += (known.empty() ? "" : ", ") + std::string(format.name);
    throw std::invalid_argument(text(0, words.size(), " numbers: poses are ", known));
  }

 private:
  bool is_csv_;
};

/// A unit of stamps, with its length in ns.
struct StampUnit {
  const char* name;
  std::int64_t length;
};

/// As the head names it, or by the time of day that the first stamp is in or, of other clocks, by the usual interval:
/// numbers that are thousands apart are no seconds.
StampUnit unitOf(const std::vector<std::string>& stamps, const std::string& head) {
  static const StampUnit units[] = {{"ns", 1}, {"us", 1000}, {"ms", 1000000}, {"s", 1000000000}};
  for (const StampUnit& unit : units)
    if (head.find(std::string("[") + unit.name + "]") < head.find(',')) return unit;
  constexpr double kEarliest = 9e8, kLatest = 4e9;  // s, 1998 to 2096
  const auto number = [](const std::string& stamp) { return static_cast<double>(parseNumber<long double>(stamp)); };
  const double first = number(stamps.front());
  for (const StampUnit& unit : units) {
    const double seconds = first * 1e-9 * static_cast<double>(unit.length);
    if (seconds > kEarliest && seconds < kLatest) return unit;
  }
  std::vector<double> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    intervals.push_back(std::abs(number(stamps[i]) - number(stamps[i - 1])));
  constexpr double kMostSeconds = 1e3, kMostMicroseconds = 1e5;  // from pose to pose; the latter are ns beyond
  const double interval = intervals.empty() ? 0.0 : median(intervals);
  return units[interval < kMostSeconds ? 3 : interval < kMostMicroseconds ? 1 : 0];
}

std::int64_t parseStamp(const std::string& word, const StampUnit& unit) {
  if (word.find('.') == std::string::npos && unit.length == 1) return parseNanoseconds(word);
  const long double value = parseNumber<long double>(word) * static_cast<long double>(unit.length);
  if (std::abs(value) > 9e18L) throw std::invalid_argument("'" + word + "' is out of range");
  return std::llround(value);
}

/// `wanted`: the only format accepted; null: any.
StampedTrajectory readPosesAs(const std::string& path, const PoseFormat* wanted) {
  StampedTrajectory trajectory;
  const PoseFormat* format = nullptr;
  std::optional<PoseTable> table;
  std::vector<std::size_t> columns;
  std::vector<std::string> stamps;
  int without_numbers = 0;
  std::string head;  // the first line, if it names columns
  std::getline(openTextFile(path), head);
  head.erase(0, std::min(head.find_first_not_of("#% \xef\xbb\xbf"), head.size()));
  if (head.empty() || !std::isalpha(static_cast<unsigned char>(head.front())) || head.rfind("nan", 0) == 0) head.clear();
  const auto isNaN = [](const std::string& word) { return word == "nan" || word == "NaN" || word == "-nan"; };
  readLines(path, true, [&](const std::string& line) {
    if (!table && !head.empty() && line.find(head.substr(0, head.find_last_not_of(" \t\r") + 1)) != std::string::npos)
      return;
    if (!table) {
      table.emplace(line);
      columns = PoseTable::columnsOf(head);
    }
    std::vector<std::string> words = table->wordsOf(line);
    if (!columns.empty() && words.size() > *std::max_element(columns.begin(), columns.end())) {
      std::vector<std::string> ordered;
      for (const std::size_t column : columns) ordered.push_back(words[column]);
      words = std::move(ordered);
      if (!format) format = &kTum;
    }
    if (!format) format = &table->formatOf(words);
    if (wanted && format->numbers != wanted->numbers)
      throw std::invalid_argument("poses in " + std::string(format->name) + " format, expected " + wanted->name);
    if (words.size() < format->numbers || (words.size() > format->numbers && format != &kEuroc))
      throw std::invalid_argument(text(0, "expected ", format->numbers, " numbers, found ", words.size()));
    words.resize(format->numbers);
    if (format->has_stamp && std::any_of(words.begin() + 1, words.end(), isNaN)) {
      ++without_numbers;
      return;
    }
    std::vector<double> numbers;
    std::transform(words.begin() + (format->has_stamp ? 1 : 0), words.end(), std::back_inserter(numbers),
                   parseNumber<double>);
    trajectory.poses.push_back(format->read(numbers));
    if (!format->has_stamp) return;
    const auto stamp = parseNumber<long double>(words[0]);
    if (!stamps.empty() && stamp <= parseNumber<long double>(stamps.back()))
      throw std::invalid_argument("stamp " + words[0] + " is not later than the one before");
    stamps.push_back(words[0]);
  });
  if (trajectory.poses.empty()) throw std::runtime_error("file '" + path + "' contains no poses");
  if (!stamps.empty()) {
    const bool in_ns = format->name == kStampedKitti.name && stamps[0].find('.') == std::string::npos;
    const StampUnit unit = in_ns ? StampUnit{"ns", 1} : unitOf(stamps, head);
    try {
      for (const std::string& stamp : stamps) trajectory.stamps.push_back(parseStamp(stamp, unit));
    } catch (const std::invalid_argument& e) {
      throw std::runtime_error("file '" + path + "': " + e.what());
    }
    if (unit.length != 1000000000 && !in_ns && format->name != kEuroc.name && head.find('[') == std::string::npos)
      trajectory.remarks.push_back("stamps of '" + path + "' are in " + unit.name);
  }
  if (without_numbers > 0)
    trajectory.remarks.push_back(text(0, without_numbers, " lines of '", path, "' have no numbers (NaN), left out"));
  return trajectory;
}

/// Poses further apart than this (ns) are not interpolated: the motion between them may be anything.
constexpr std::int64_t kLongestGap = 500000000;

}  // namespace

std::optional<Eigen::Isometry3d> poseAt(const StampedTrajectory& truth, std::int64_t stamp) {
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
      sums.rotation_deg_per_m += degreesOf(error.linear()) / length;
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
    squared_rotation += std::pow(degreesOf(error.linear()), 2);
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
    errors.final_drift_deg = degreesOf(error.linear());
    errors.largest_drift_m = std::max(errors.largest_drift_m, error.translation().norm());
    errors.largest_drift_deg = std::max(errors.largest_drift_deg, errors.final_drift_deg);
  }
  errors.scale = scaleOfSteps(truth, estimate);
  return errors;
}

std::vector<std::optional<Eigen::Isometry3d>> readGroundTruth(const std::string& path,
                                                              const std::vector<std::int64_t>& stamps,
                                                              const std::vector<std::size_t>& numbers,
                                                              std::size_t first) {
  const StampedTrajectory truth = readPoses(path);
  std::vector<std::optional<Eigen::Isometry3d>> poses;
  if (truth.stamps.empty()) {
    const std::size_t lines = numbers.empty() ? 0 : numbers.back() + 1;
    const std::size_t before = truth.poses.size() >= first + lines ? first : 0;
    if (truth.poses.size() < lines)
      throw std::runtime_error(text(0, "file '", path, "' has ", truth.poses.size(), " poses for ", lines,
                                    " left images: one line for each is needed, or stamps as in ", kTum.name,
                                    " format"));
    for (const std::size_t number : numbers) poses.emplace_back(truth.poses[before + number]);
    return poses;
  }
  for (const std::int64_t stamp : stamps) poses.push_back(poseAt(truth, stamp));
  if (std::count_if(poses.begin(), poses.end(), [](const auto& pose) { return pose.has_value(); }) < 2)
    throw std::runtime_error("file '" + path + "' has no poses at the stamps of the recording");
  return poses;
}

}  // namespace sdvo
