#include "drive_page.hpp"

#include <rosbag/view.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "../messages/feature_conversions.hpp"
#include "../messages/odometry_conversions.hpp"
#include "../ros/publishers/features_image.hpp"
#include "page.hpp"
#include "stereo_messages.hpp"

namespace sdvo {
namespace {

using Frames = std::vector<OfflineRun::Frame>;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 180.0 / M_PI;

/// A number of each pair, with the name that page.html uses.
struct Column {
  const char* name;
  int digits;  ///< after the point
  double (*of)(const OfflineRun::Frame&);
};

/// Standard deviation of the pose's position (block 0, m) or rotation (block 1, rad).
double sigmaOf(const OfflineRun::Frame& frame, int block) {
  const OdometryResult& odometry = frame.odometry;
  return odometry.has_pose ? std::sqrt(odometry.pose_covariance.diagonal().segment<3>(3 * block).sum()) : kUnknown;
}

const Column kColumns[] = {
    {"sigma_m", 5, [](const OfflineRun::Frame& f) { return sigmaOf(f, 0); }},
    {"sigma_deg", 4, [](const OfflineRun::Frame& f) { return kDegrees * sigmaOf(f, 1); }},
    {"corners", 0, [](const OfflineRun::Frame& f) { return 1.0 * f.extraction.detected; }},
    {"features", 0, [](const OfflineRun::Frame& f) { return 1.0 * f.odometry.features; }},
    {"matches", 0, [](const OfflineRun::Frame& f) { return 1.0 * f.odometry.matches; }},
    {"inliers", 0, [](const OfflineRun::Frame& f) { return 1.0 * f.odometry.inliers; }},
    {"detect", 2, [](const OfflineRun::Frame& f) { return 1e3 * f.extraction.detect_time; }},
    {"stereo", 2, [](const OfflineRun::Frame& f) { return 1e3 * f.extraction.stereo_time; }},
    {"describe", 2, [](const OfflineRun::Frame& f) { return 1e3 * f.extraction.describe_time; }},
    {"match", 2, [](const OfflineRun::Frame& f) { return 1e3 * f.odometry.match_time; }},
    {"motion", 2, [](const OfflineRun::Frame& f) { return 1e3 * f.odometry.motion_time; }},
};

/// x y z (m) and the quaternion x y z w.
std::string listOfPose(const std::optional<Eigen::Isometry3d>& pose) {
  if (!pose) return "null";
  const Eigen::Vector3d t = pose->translation();
  const Eigen::Quaterniond q(pose->linear());
  return listOf(std::array{t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}, [](double v) { return number(v, 6); });
}

/// A list for each column.
std::string columnsOf(const DriveReport& report, const Frames& frames, std::size_t step) {
  const std::vector<std::size_t> shown = worstOfEach(frames, step);
  const auto list = [&](const auto& of) { return listOf(shown, [&](std::size_t i) { return of(frames[i]); }); };
  const auto poseOf = [](const OfflineRun::Frame& frame) {
    return listOfPose(frame.odometry.has_pose ? std::optional(frame.odometry.T_origin_camera) : std::nullopt);
  };
  const auto timeOf = [&](const OfflineRun::Frame& frame) {
    return std::to_string(frame.odometry.stamp - frames.front().odometry.stamp);
  };
  JsonMembers members = {{"ns", list(timeOf)},
                         {"state", list([](const OfflineRun::Frame& f) { return quoted(toString(f.odometry.state)); })},
                         {"reason", list([](const OfflineRun::Frame& f) { return quoted(f.odometry.reason); })},
                         {"pose", list(poseOf)}};
  if (!report.truth.empty())
    members.emplace_back("truth", listOf(shown, [&](std::size_t i) { return listOfPose(report.truth[i]); }));
  for (const Column& column : kColumns)
    members.emplace_back(column.name,
                         list([&](const OfflineRun::Frame& f) { return number(column.of(f), column.digits); }));
  return objectOf(members);
}

/// Errors over the pairs that have a true and an estimated pose; none with fewer than two.
std::optional<TrajectoryErrors> errorsOf(const DriveReport& report, const Frames& frames) {
  Trajectory truth, estimate;
  for (std::size_t i = 0; i < report.truth.size(); ++i) {
    if (!report.truth[i] || !frames[i].odometry.has_pose) continue;
    truth.push_back(*report.truth[i]);
    estimate.push_back(frames[i].odometry.T_origin_camera);
  }
  if (truth.size() < 2) return std::nullopt;
  const double length = distancesTravelled(truth).back();
  std::vector<double> lengths = length > 1000.0 ? kittiLengths() : std::vector<double>();
  for (const double part : {0.05, 0.1, 0.2, 0.3, 0.5})
    if (length <= 1000.0 && length > 0.0) lengths.push_back(part * length);
  return evaluateTrajectory(truth, estimate, lengths);
}

std::string percent(double value) {
  return std::isfinite(value) ? text(value < 0.1 ? 3 : 2, value, " %") : "-";
}

std::array<int, 4> countStates(const Frames& frames) {
  std::array<int, 4> counts{};
  for (const OfflineRun::Frame& frame : frames) ++counts[static_cast<std::size_t>(frame.odometry.state)];
  return counts;
}

std::string stateCounts(const std::array<int, 4>& counts) {
  std::string words;
  for (const TrackingState state :
       {TrackingState::kTracking, TrackingState::kDegraded, TrackingState::kLost, TrackingState::kWaiting})
    if (const int count = counts[static_cast<std::size_t>(state)]; count > 0)
      words += (words.empty() ? "" : ", ") + std::to_string(count) + " " + toString(state);
  return words;
}

std::vector<Words> figuresOf(const DriveReport& report, const OfflineRun& run) {
  const Frames& frames = run.frames();
  std::vector<Words> rows = {
      {"pairs", std::to_string(run.pairs()) + ": " + stateCounts(countStates(frames))},
      {"distance",
       text(2, run.distance(), " m in ",
            1e-9 * static_cast<double>(frames.back().odometry.stamp - frames.front().odometry.stamp), " s")},
      {"discontinuities of the pose", std::to_string(run.discontinuities())},
      {"time of a pair", run.times().words() + "; without reading and decoding"}};
  // Stamps of a folder may begin at zero, those of a simulation, too.
  constexpr std::int64_t kThisCentury = 1000000000LL * 1000000000LL;
  if (frames.front().odometry.stamp > kThisCentury)
    rows.push_back({"first stamp", dateOf(frames.front().odometry.stamp)});
  if (report.left_out > 0) rows.push_back({"stamps without a usable pair", std::to_string(report.left_out)});
  for (const SelfCheck& check : report.self_checks)
    rows.push_back({check.name == "shuttle" ? "implied error, there and back" : "implied error, half of the features each",
                    check.text()});
  if (const auto errors = errorsOf(report, frames)) {
    const auto& lengths = errors->per_length;
    rows.push_back({"true error", percent(errors->sub_paths.translation_percent) +
                                      text(4, " and ", errors->sub_paths.rotation_deg_per_m, " deg/m over sub-paths") +
                                      (lengths.empty() ? std::string()
                                                       : text(1, " of ", lengths.front().length, " to ",
                                                              lengths.back().length, " m")) +
                                      text(3, "; at the end off by ", errors->final_drift_m, " m (",
                                           errors->final_drift_percent, " %) and ", errors->final_drift_deg, " deg")});
  }
  if (report.live) {
    const LiveRecord& live = *report.live;
    rows.push_back({"while it ran", stateCounts(live.states) +
                                        text(0, "; ", live.dropped_pairs, " pairs dropped, ", live.discontinuities,
                                             " discontinuities; ") +
                                        text(0, "published ", 1e3 * quantile(live.latencies, 0.5), " ms (median), ",
                                             1e3 * quantile(live.latencies, 0.95), " ms (95 %) after the image")});
  }
  return rows;
}

/// Options with a value other than the default, as rows of name, value and default.
std::vector<Words> optionsOf(PipelineOptions options) {
  PipelineOptions defaults;
  const std::vector<Option> set = listOptions(options), usual = listOptions(defaults);
  std::vector<Words> rows;
  for (std::size_t i = 0; i < set.size(); ++i)
    if (set[i].text() != usual[i].text())
      rows.push_back({set[i].name, set[i].text() + " " + set[i].unit, "default " + usual[i].text()});
  return rows;
}

}  // namespace

cv::Mat drawLeft(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result) {
  const cv::Mat both = drawFeatures(pair.left, pair.right, ros_conversions::toMessage(features, DepthScaleOptions()),
                                    ros_conversions::toFlow(result, features), toString(result.state));
  return both.rowRange(0, pair.left.rows);
}

void DrivePictures::add(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result) {
  if (seen_ == 0) first_stamp_ = pair.stamp;
  const bool is_tracking = result.state == TrackingState::kTracking;
  const bool is_end = was_tracking_ && !is_tracking && ends_ < kEnds;
  // The first pair has no flow yet.
  const bool is_due = spread_ < kSpread && seen_ >= (2 * spread_ + 1) * pairs_ / (2 * kSpread);
  if (is_end || is_due) {
    const double seconds = 1e-9 * static_cast<double>(pair.stamp - first_stamp_);
    const bool is_new = std::exchange(reason_, result.reason) != result.reason;  // a refused drive has one throughout
    pictures_.push_back({drawLeft(pair, features, result).clone(),
                         text(1, seconds, " s, ", toString(result.state), is_new && !reason_.empty() ? ": " : "",
                              is_new ? reason_ : "")});
  }
  if (is_end) ++ends_;
  if (is_due) ++spread_;
  was_tracking_ = is_tracking;
  ++seen_;
}

Finding judge(const DriveReport& report, const OfflineRun& run) {
  const std::array<int, 4> states = countStates(run.frames());
  const int tracking = states[static_cast<std::size_t>(TrackingState::kTracking)];
  const CheckStep worst = worstOf(report.steps);
  Finding verdict{worst.finding.verdict};
  if (run.pairsWithoutPose() > 0 || run.discontinuities() > 0) {
    if (verdict.verdict != Verdict::kFail) verdict.verdict = Verdict::kWarn;
    const int poses = run.pairs() - run.pairsWithoutPose();
    verdict.what =
        poses < 2 ? text(0, "Never started: ", poses == 0 ? "none" : "one", " of ", run.pairs(), " pairs has a pose")
                  : text(0, "Interrupted: ", run.pairsWithoutPose(), " of ", run.pairs(), " pairs have no pose, ",
                         run.discontinuities(), run.discontinuities() == 1 ? " discontinuity" : " discontinuities");
  } else {
    verdict.what =
        text(0, "Followed: ", run.pairs(), " of ", run.pairs(), " pairs have a pose, ", tracking, " are TRACKING");
    double implied = 0.0;  // the larger one of those known
    for (const SelfCheck& check : report.self_checks)
      if (check.problem.empty() && check.difference.count > 0) implied = std::max(implied, check.errorPercent());
    if (const auto errors = errorsOf(report, run.frames()); errors && errors->sub_paths.count > 0)
      verdict.what += "; error " + percent(errors->sub_paths.translation_percent) + " of the distance";
    else if (implied > 0.0)
      verdict.what +=
          "; random errors of about " + percent(implied) + " of the distance, beside those of the calibration";
  }
  if (worst.finding.isFault()) {
    verdict.what += ". Camera: " + worst.text();
    verdict.remedy = worst.finding.remedy;
  }
  return verdict;
}

std::vector<std::size_t> worstOfEach(const Frames& frames, std::size_t step) {
  const auto rankOf = [&](std::size_t i) {
    const TrackingState state = frames[i].odometry.state;
    return state == TrackingState::kTracking ? 0 : 1 + static_cast<int>(state);
  };
  std::vector<std::size_t> worst;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (i % step == 0)
      worst.push_back(i);
    else if (rankOf(i) > rankOf(worst.back()))
      worst.back() = i;
  return worst;
}

void writeDrivePage(const std::string& path, const DriveReport& report, const OfflineRun& run) {
  // The page has less than 2 MB; 3000 pairs have 0.8 MB.
  constexpr std::size_t kMostPairs = 3000, kMostBytes = 1100000;
  const Frames& frames = run.frames();
  const std::size_t step = (frames.size() + kMostPairs - 1) / kMostPairs;
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity();
  T_base_camera.linear() = report.R_base_camera;
  const auto pictureOfDrive = [&](const DrivePictures::Picture& picture) {
    return pictureOf(picture.image, picture.words, kMostBytes / report.pictures.size());
  };
  writePage(path, report.name, judge(report, run), report.steps, report.rows,
            {{"figures", tableOf(figuresOf(report, run))},
             {"options", tableOf(optionsOf(report.options))},
             {"first_stamp", quoted(std::to_string(frames.front().odometry.stamp))},
             {"step", std::to_string(step)},
             {"T_base_camera", listOfPose(T_base_camera)},
             {"pairs", columnsOf(report, frames, step)},
             {"pictures", listOf(report.pictures, pictureOfDrive)}});
}

using stereo_descriptor_vo::VoInfo;

std::optional<LiveRecord> readLiveRecord(const rosbag::Bag& bag) {
  LiveRecord record;
  std::string topic;
  std::optional<VoInfo> before;
  for (const rosbag::MessageInstance& instance :
       rosbag::View(bag, rosbag::TypeQuery(ros::message_traits::datatype<VoInfo>()))) {
    if (topic.empty()) topic = instance.getTopic();
    const VoInfo::ConstPtr info = instance.getTopic() == topic ? readAs<VoInfo>(instance) : nullptr;
    if (!info || info->state_id >= record.states.size()) continue;
    ++record.states[info->state_id];
    if (std::isfinite(info->latency)) record.latencies.push_back(info->latency);
    if (before && (before->epoch != info->epoch || before->session != info->session)) ++record.discontinuities;
    record.dropped_pairs = info->dropped_pairs + info->dropped_features;
    before = *info;
  }
  return before ? std::optional(record) : std::nullopt;
}

}  // namespace sdvo
