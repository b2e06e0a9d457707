#include "drive_page.hpp"

#include <rosbag/view.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "page.hpp"
#include "plot.hpp"
#include "stereo_messages.hpp"

namespace sdvo {
namespace {

using Frames = std::vector<OfflineRun::Frame>;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 180.0 / M_PI;
const char* const kBlue = "#1f6fb4";
const char* const kGreen = "#2e8b3d";
const char* const kOrange = "#d9730d";
const char* const kRed = "#c62828";
const char* const kGrey = "#7a7a7a";

/// A value of each pair.
template <class Value>
std::vector<double> ofEach(const Frames& frames, const Value& value) {
  std::vector<double> values;
  for (const OfflineRun::Frame& frame : frames) values.push_back(value(frame));
  return values;
}

/// Since the first pair, s.
std::vector<double> timesOf(const Frames& frames) {
  return ofEach(frames, [&](const OfflineRun::Frame& frame) {
    return 1e-9 * static_cast<double>(frame.odometry.stamp - frames.front().odometry.stamp);
  });
}

double angleOf(const Eigen::Isometry3d& transform) {
  return kDegrees * Eigen::AngleAxisd(transform.linear()).angle();
}

/// The true poses in the frame of the estimated ones: laid upon the first one of which both are known.
std::vector<std::optional<Eigen::Isometry3d>> alignedTruth(const DriveReport& report, const Frames& frames) {
  std::optional<Eigen::Isometry3d> T_origin_world;
  std::vector<std::optional<Eigen::Isometry3d>> aligned(report.truth.size());
  for (std::size_t i = 0; i < aligned.size(); ++i) {
    if (!report.truth[i]) continue;
    if (!T_origin_world && frames[i].odometry.has_pose)
      T_origin_world = frames[i].odometry.T_origin_camera * report.truth[i]->inverse();
    if (T_origin_world) aligned[i] = *T_origin_world * *report.truth[i];
  }
  return aligned;
}

/// Errors of the pairs of which both poses are known; none where there are fewer than two.
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

/// Steps of a pair, each with its colour.
struct Stage {
  const char* name;
  const char* colour;
  double (*value)(const OfflineRun::Frame&);
};

const std::array<Stage, 5> kTimes = {{
    {"detect", kBlue, [](const OfflineRun::Frame& f) { return 1e3 * f.extraction.detect_time; }},
    {"stereo", kGreen, [](const OfflineRun::Frame& f) { return 1e3 * f.extraction.stereo_time; }},
    {"describe", kOrange, [](const OfflineRun::Frame& f) { return 1e3 * f.extraction.describe_time; }},
    {"match", kGrey, [](const OfflineRun::Frame& f) { return 1e3 * f.odometry.match_time; }},
    {"motion", kRed, [](const OfflineRun::Frame& f) { return 1e3 * f.odometry.motion_time; }},
}};

const std::array<Stage, 4> kFunnel = {{
    {"corners", kGrey, [](const OfflineRun::Frame& f) { return 1.0 * f.extraction.detected; }},
    {"features", kBlue, [](const OfflineRun::Frame& f) { return 1.0 * f.odometry.features; }},
    {"matches", kOrange, [](const OfflineRun::Frame& f) { return 1.0 * f.odometry.matches; }},
    {"inliers", kGreen, [](const OfflineRun::Frame& f) { return 1.0 * f.odometry.inliers; }},
}};

template <std::size_t count>
std::string stagesPlot(const Axes& axes, const std::array<Stage, count>& stages, const Frames& frames) {
  std::vector<Curve> curves;
  for (const Stage& stage : stages)
    curves.push_back({stage.name, stage.colour, timesOf(frames), ofEach(frames, stage.value)});
  return plot(axes, std::move(curves));
}

/// From above and its height, in the axes of the base at the first pair.
std::string pathPlots(const DriveReport& report, const Frames& frames) {
  Curve above{"odometry", kBlue, {}, {}}, height{"odometry", kBlue, timesOf(frames), {}};
  Curve true_above{"ground truth", kGreen, {}, {}}, true_height{"ground truth", kGreen, timesOf(frames), {}};
  const auto add = [&](Curve& path, Curve& up, const std::optional<Eigen::Isometry3d>& pose) {
    const Eigen::Vector3d at =
        pose ? Eigen::Vector3d(report.R_base_camera * pose->translation()) : Eigen::Vector3d::Constant(kUnknown);
    path.x.push_back(-at.y());
    path.y.push_back(at.x());
    up.y.push_back(at.z());
  };
  for (const OfflineRun::Frame& frame : frames)
    add(above, height, frame.odometry.has_pose ? std::optional(frame.odometry.T_origin_camera) : std::nullopt);
  std::vector<Curve> paths, heights;
  if (!report.truth.empty()) {
    for (const auto& pose : alignedTruth(report, frames)) add(true_above, true_height, pose);
    paths = {true_above};
    heights = {true_height};
  }
  paths.push_back(above);
  heights.push_back(height);
  return plot({"Path from above", "to the right [m]", "ahead [m]", Axes::Style::kEqualScales}, paths) +
         plot({"Height", "time [s]", "m"}, heights);
}

/// Standard deviations of the pose, and its errors where the truth is known.
std::string deviationPlots(const DriveReport& report, const Frames& frames) {
  const auto sigma = [&](int block) {
    return ofEach(frames, [block](const OfflineRun::Frame& frame) {
      const OdometryResult& odometry = frame.odometry;
      return odometry.has_pose ? std::sqrt(odometry.pose_covariance.diagonal().segment<3>(3 * block).sum()) : kUnknown;
    });
  };
  std::vector<double> metres = sigma(0), degrees = sigma(1);
  for (double& value : degrees) value *= kDegrees;
  std::vector<Curve> position = {{"sigma", kBlue, timesOf(frames), metres}};
  std::vector<Curve> rotation = {{"sigma", kBlue, timesOf(frames), degrees}};
  if (!report.truth.empty()) {
    Curve off{"error", kRed, timesOf(frames), {}}, turned = off;
    const auto truth = alignedTruth(report, frames);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const bool is_known = truth[i] && frames[i].odometry.has_pose;
      const Eigen::Isometry3d error =
          is_known ? truth[i]->inverse() * frames[i].odometry.T_origin_camera : Eigen::Isometry3d::Identity();
      off.y.push_back(is_known ? error.translation().norm() : kUnknown);
      turned.y.push_back(is_known ? angleOf(error) : kUnknown);
    }
    position.push_back(off);
    rotation.push_back(turned);
  }
  return plot({"Deviation of the position", "time [s]", "m"}, position) +
         plot({"Deviation of the rotation", "time [s]", "deg"}, rotation);
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

/// A bar of all pairs, and the reasons of those that are not TRACKING.
std::string statesSection(const Frames& frames) {
  constexpr std::size_t kMostRows = 15;
  const std::vector<const char*> colours = {kGreen, kGrey, kOrange, kRed};
  const auto rankOf = [](TrackingState state) {
    return std::array<int, 4>{1, 0, 2, 3}[static_cast<std::size_t>(state)];
  };
  std::string legend;
  std::vector<int> ranks;
  for (const OfflineRun::Frame& frame : frames) ranks.push_back(rankOf(frame.odometry.state));
  for (const TrackingState state :
       {TrackingState::kTracking, TrackingState::kWaiting, TrackingState::kDegraded, TrackingState::kLost})
    if (std::count(ranks.begin(), ranks.end(), rankOf(state)) > 0)
      legend +=
          text(0, " <b style='color:", colours[static_cast<std::size_t>(rankOf(state))], "'>", toString(state), "</b>");
  const std::vector<double> times = timesOf(frames);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t begin = 0, end = 0; begin < frames.size(); begin = end) {
    while (end < frames.size() && ranks[end] == ranks[begin]) ++end;
    if (ranks[begin] > 0)
      rows.push_back({text(1, times[begin], " s"), toString(frames[begin].odometry.state),
                      std::to_string(end - begin) + (end - begin == 1 ? " pair" : " pairs"),
                      frames[begin].odometry.reason});
  }
  std::string more;
  if (rows.size() > kMostRows) {
    more = "<p>and " + std::to_string(rows.size() - kMostRows) + " more stretches</p>\n";
    rows.resize(kMostRows);
  }
  return "<h2>States over time</h2>\n" + band(ranks, colours) +
         text(1, "<p>0 to ", times.back(), " s:", legend, "</p>\n") + "<div class='when'>" + wordsTable(rows) +
         "</div>" + more;
}

std::string figuresSection(const DriveReport& report, const OfflineRun& run) {
  const Frames& frames = run.frames();
  std::vector<std::vector<std::string>> rows = {
      {"pairs", std::to_string(run.pairs()) + ": " + stateCounts(countStates(frames))},
      {"distance", text(2, run.distance(), " m in ", timesOf(frames).back(), " s")},
      {"discontinuities of the pose", std::to_string(run.discontinuities())},
      {"time of a pair", text(1, run.time(0.5), " ms (median), ", run.time(0.95), " ms (95 %), ", run.cpuTime(),
                              " ms of CPU; without reading and decoding")}};
  // Stamps of a folder may begin at zero, those of a simulation, too.
  constexpr std::int64_t kThisCentury = 1000000000LL * 1000000000LL;
  if (frames.front().odometry.stamp > kThisCentury)
    rows.push_back({"first stamp", dateOf(frames.front().odometry.stamp)});
  if (report.left_out > 0) rows.push_back({"stamps without a usable pair", std::to_string(report.left_out)});
  for (const SelfCheck& check : report.self_checks) rows.push_back({"implied error", check.text()});
  if (const auto errors = errorsOf(report, frames)) {
    rows.push_back(
        {"true error", percent(errors->sub_paths.translation_percent) + " and " +
                           text(4, errors->sub_paths.rotation_deg_per_m, " deg/m over sub-paths; at the end off by ") +
                           text(3, errors->final_drift_m, " m (", errors->final_drift_percent, " %) and ",
                                errors->final_drift_deg, " deg")});
  }
  if (report.live) {
    const LiveRecord& live = *report.live;
    rows.push_back({"while it ran", stateCounts(live.states) +
                                        text(0, "; ", live.dropped_pairs, " pairs dropped, ", live.discontinuities,
                                             " discontinuities; ") +
                                        text(0, "published ", 1e3 * quantile(live.latencies, 0.5), " ms (median), ",
                                             1e3 * quantile(live.latencies, 0.95), " ms (95 %) after the image")});
  }
  return wordsTable(rows);
}

std::string optionsSection(PipelineOptions options) {
  PipelineOptions defaults;
  const std::vector<Option> set = listOptions(options), usual = listOptions(defaults);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < set.size(); ++i)
    if (set[i].text() != usual[i].text())
      rows.push_back({set[i].name, set[i].text() + " " + set[i].unit, "default " + usual[i].text()});
  return "<h2>Options that differ from the defaults</h2>\n" +
         (rows.empty() ? "<p>none</p>\n" : "<div class='wide'>" + wordsTable(rows) + "</div>\n");
}

std::string picturesSection(const std::vector<DrivePictures::Picture>& pictures) {
  constexpr std::size_t kMostBytes = 1500000;  // all of them: the page has less than 2 MB
  std::string html =
      "<h2>Features</h2>\n<p>Circles have the size that the depth gives, near ones red and far ones blue. Lines lead "
      "from where a feature was before: green ones agree with the motion, magenta ones do not.</p>\n<div class='grid'>";
  for (const DrivePictures::Picture& one : pictures)
    html += picture(one.image, one.words, kMostBytes / pictures.size());
  return html + "</div>\n";
}

}  // namespace

Finding judge(const DriveReport& report, const OfflineRun& run) {
  const std::array<int, 4> states = countStates(run.frames());
  const int tracking = states[static_cast<std::size_t>(TrackingState::kTracking)];
  const Finding worst = worstOf(report.findings);
  Finding verdict{"drive", worst.verdict, "", ""};
  if (run.pairsWithoutPose() > 0 || run.discontinuities() > 0) {
    if (verdict.verdict != Verdict::kFail) verdict.verdict = Verdict::kWarn;
    verdict.what =
        run.pairsWithoutPose() == run.pairs()
            ? text(0, "Never started: none of ", run.pairs(), " pairs has a pose")
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
      verdict.what += "; random errors of about " + percent(implied) + " of the distance, beside those of the calibration";
  }
  if (worst.verdict == Verdict::kWarn || worst.verdict == Verdict::kFail)
    verdict.what += ". Camera: " + std::string(toString(worst.verdict)) + ", " + worst.step + ": " + worst.what;
  return verdict;
}

void writeDrivePage(const std::string& path, const DriveReport& report, const OfflineRun& run) {
  const Finding verdict = judge(report, run);
  const Frames& frames = run.frames();
  writePage(path, pageHead(report.name, verdict.verdict, verdict.what) + figuresSection(report, run) +
                      "<h2>Path and what it is built on</h2>\n<div class='grid'>" +
                      (run.pairsWithoutPose() < run.pairs() ? pathPlots(report, frames) + deviationPlots(report, frames)
                                                            : std::string()) +
                      stagesPlot({"What survives each stage", "time [s]", "count"}, kFunnel, frames) +
                      stagesPlot({"Time of each stage", "time [s]", "ms", Axes::Style::kStacked}, kTimes, frames) +
                      "</div>\n" + statesSection(frames) + "<h2>The camera</h2>\n" + findingsTable(report.findings) +
                      rowsTable(report.rows) + picturesSection(report.pictures) + optionsSection(report.options));
}

using stereo_descriptor_vo::VoInfo;

int LiveRecord::pairs() const {
  return std::accumulate(states.begin(), states.end(), 0);
}

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
