#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceInfo.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "../../check/arrival_log.hpp"
#include "../../check/image_check.hpp"
#include "../../check/input_monitor.hpp"
#include "../../check/row_check.hpp"
#include "../../check/unused_input.hpp"
#include "../../check/work_load.hpp"
#include "../../common/text.hpp"
#include "../../config/interface_options.hpp"
#include "../../messages/stamps.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// /diagnostics once a second of wall time: simulated time stands still at the end of a bag, which diagnostics must
/// report. Declare it after the members that its tasks use.
class WallUpdater {
 public:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;
  using Level = diagnostic_msgs::DiagnosticStatus;

  WallUpdater(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name)
      : updater_(nh, private_nh, name) {
    updater_.setHardwareID("none");
    timer_ =
        nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { updater_.force_update(); });
  }

  template <class Owner>
  void add(const std::string& task, Owner* owner, Findings (Owner::*judge)(Values& values)) {
    updater_.add(task, [owner, judge](Status& status) {
      Values values;
      print((owner->*judge)(values), status);
      for (const auto& [name, value] : values.all()) status.add(name, value);
    });
  }

  /// The first finding, and the faults among the others.
  static void print(const Findings& findings, Status& status) {
    for (const Finding& finding : findings) {
      const auto level = finding.verdict == Verdict::kFail   ? Level::ERROR
                         : finding.verdict == Verdict::kWarn ? Level::WARN
                                                             : Level::OK;
      if (&finding == &findings.front())
        status.summary(level, finding.text());
      else
        status.mergeSummary(level, finding.text());
    }
  }

 private:
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
};

/// /diagnostics of the image side. Tasks: rate, synchronisation, exposure, features, load.
class ImageDiagnostics {
 public:
  ImageDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                   const StereoInputOptions& options, ArrivalLog& arrivals, UnusedInput& unused)
      : thresholds_(options.thresholds),
        arrivals_(arrivals),
        unused_(unused),
        load_(options.thresholds.max_load),
        updater_(nh, private_nh, name) {
    arrivals_.pairs().noteTopics(nh.resolveName("left/image_rect") + " and " + nh.resolveName("right/image_rect"));
    updater_.add("input rate", &arrivals_.pairs(), &InputMonitor::judge);
    updater_.add("synchronisation", this, &ImageDiagnostics::judgeSynchronisation);
    updater_.add("exposure", this, &ImageDiagnostics::judgeExposure);
    updater_.add("features", this, &ImageDiagnostics::judgeFeatures);
    updater_.add("load", &load_, &WorkLoad::judge);
  }

  WorkLoad& load() { return load_; }
  /// For each processed pair; for each that could not be processed, with the reason.
  void note(const StereoFeatures& features) {
    const std::lock_guard<std::mutex> lock(mutex_);
    exposures_.add(features.report.mean_intensity[0]);
    last_ = features.report;
    last_count_ = features.count();
    refusals_.add(features.report);
  }

  void noteFailure(const std::string& why) {
    const std::lock_guard<std::mutex> lock(mutex_);
    failure_ = why;
  }

 private:
  static constexpr const char* kNoPairs = "no pairs";  // the task "input rate" has the reason

  Findings judgeSynchronisation(Values& values) {
    return unused_.judge(arrivals_.checkPairs(ros::SteadyTime::now().toSec(), thresholds_.max_gap, values), values);
  }

  Findings judgeExposure(Values& values) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (arrivals_.pairs().silence()) return {{Verdict::kOk, kNoPairs}};
    if (!last_ || (refusals_.pairs() == 0 && !failure_.empty())) return {{Verdict::kOk, "no pair was used"}};
    const double left = last_->mean_intensity[0], right = last_->mean_intensity[1];
    values.add("mean grey level", text(1, left, " left, ", right, " right"));
    values.add("sharpness [grey levels a px]", text(2, last_->sharpness[0], " left, ", last_->sharpness[1], " right"));
    return {checkExposure(std::min(left, right), std::max(left, right), exposures_.takeTurns(),
                          thresholds_.min_intensity, thresholds_.max_intensity)
                .asWarning()};
  }

  Findings judgeFeatures(Values& values) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::string failure = std::exchange(failure_, "");
    const RefusalCheck refusals = std::exchange(refusals_, {});
    if (arrivals_.pairs().silence()) return {{Verdict::kOk, kNoPairs}};
    values.add("corners", last_ ? last_->detected : 0);
    values.add("features", last_count_);
    values.add("refused pairs, of the last second", text(0, refusals.refused(), " of ", refusals.pairs()));
    if (!failure.empty()) return {{Verdict::kFail, failure}};
    if (refusals.refused() > 0) return {refusals.judge(0.0)};
    if (last_)
      if (const Finding few = checkCorners(last_->detected, thresholds_.min_corners); few.isFault())
        return {few.asWarning()};
    if (last_ && !last_->status.empty()) return {{Verdict::kWarn, last_->status}};
    return {{Verdict::kOk, text(0, last_count_, " features")}};
  }

  const ImageThresholds thresholds_;
  ArrivalLog& arrivals_;
  UnusedInput& unused_;
  WorkLoad load_;

  std::mutex mutex_;
  std::optional<ExtractionReport> last_;
  int last_count_ = 0;  ///< of features
  ExposureTurns exposures_;
  std::string failure_;
  RefusalCheck refusals_;  ///< since the last call of the task

  WallUpdater updater_;
};

/// /diagnostics of the odometry. Tasks: its state in vo_info, rate of its input, load, latency.
class OdometryDiagnostics {
 public:
  OdometryDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                      const OdometryOutputOptions& options, UnusedInput& unused)
      : unused_(unused),
        input_("features", nh.resolveName("stereo_features"), expected(nh, options).max_silence,
               expected(nh, options).rates),
        load_(kMostLoad),
        updater_(nh, private_nh, name) {
    updater_.add("odometry", this, &OdometryDiagnostics::judge);
    updater_.add("input rate", this, &OdometryDiagnostics::judgeInput);
    updater_.add("load", &load_, &WorkLoad::judge);
    updater_.add("latency", this, &OdometryDiagnostics::judgeLatency);
  }

  InputMonitor& input() { return input_; }
  WorkLoad& load() { return load_; }
  /// Of each pair, as published.
  void note(const stereo_descriptor_vo::VoInfo& info) {
    load_.noteDropped(info.dropped_features);
    const std::lock_guard<std::mutex> lock(mutex_);
    last_ = info;
    input_.note(nanoseconds(info.header.stamp));  // under the lock, so that no task sees an input without its state
  }

 private:
  static constexpr double kMostLoad = 0.9;        // of one processor (chosen)
  static constexpr double kLongestLatency = 0.5;  // s, of poses after their images (chosen)

  /// With the rate and silence that the image side's max_rate leads to; the rate with a tolerance of a tenth, as in
  /// RateOptions.
  static OdometryOutputOptions expected(const ros::NodeHandle& nh, OdometryOutputOptions options) {
    const double limit = nh.param("stereo_features/max_rate", 0.0);
    if (limit <= 0.0) return options;
    options.rates.min_rate = std::min(options.rates.min_rate, 0.9 * limit);
    options.max_silence = std::max(options.max_silence, 2.0 / limit);
    return options;
  }

  Findings judge(Values& values) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (last_) addValues(values);
    if (auto silence = input_.silence()) {
      if (silence->isFault() && last_) silence->what += "; the last state was " + last_->state;
      return {*silence};
    }
    const bool is_lost = last_->state == "LOST";
    return {
        judged(is_lost, last_->state != "TRACKING", last_->state + (last_->reason.empty() ? "" : ": " + last_->reason)),
        checkMoment({last_->right_delay, last_->right_delay_sigma}).asWarning()};
  }

  Findings judgeInput(Values& values) { return unused_.judge(input_.judge(values).front(), values); }

  Findings judgeLatency(Values&) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (input_.silence() || !last_ || last_->state == "WAITING") return {{Verdict::kOk, "no pose"}};
    return {checkLatency(last_->latency, kLongestLatency)};
  }

  /// Under the lock.
  void addValues(Values& values) const {
    values.add("epoch", last_->epoch);
    values.add("features", last_->features);
    values.add("matches", last_->matches);
    values.add("inliers", last_->inliers);
    values.add("rms reprojection error [px]", last_->rms_reprojection_error);
    values.add("distance [m]", last_->distance);
    if (std::isfinite(last_->disparity_offset))
      values.add("calibration", text(2, "disparities are off by ", last_->disparity_offset, " +- ",
                                     last_->disparity_offset_sigma, " px in the centre, another ",
                                     last_->disparity_bend, " +- ", last_->disparity_bend_sigma, " px at 45 degrees"));
    if (std::isfinite(last_->right_delay))
      values.add("right camera delay [ms]", text(2, 1e3 * last_->right_delay, " +- ", 1e3 * last_->right_delay_sigma));
    if (std::isfinite(last_->readout))
      values.add("readout [ms]", text(2, 1e3 * last_->readout, " +- ", 1e3 * last_->readout_sigma));
    if (std::isfinite(last_->right_rotation[0]))
      values.add("right camera rotation [mrad]",
                 text(2, 1e3 * last_->right_rotation[0], " ", 1e3 * last_->right_rotation[1], " ",
                      1e3 * last_->right_rotation[2]));
    values.add("latency [s]", last_->latency);
    values.add("dropped pairs", last_->dropped_pairs);
  }

  UnusedInput& unused_;
  InputMonitor input_;
  WorkLoad load_;
  std::mutex mutex_;
  std::optional<stereo_descriptor_vo::VoInfo> last_;

  WallUpdater updater_;
};

/// /diagnostics of the place recognition.
class PlaceDiagnostics {
 public:
  /// `max_silence`: s, wall time. `input`: names of the topics of its input.
  PlaceDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name, const std::string& input,
                   double max_silence, UnusedInput& unused)
      : unused_(unused), input_("pairs with odometry", input, max_silence, {}), updater_(nh, private_nh, name) {
    updater_.add("places", this, &PlaceDiagnostics::judge);
  }

  /// Of pairs with odometry.
  InputMonitor& input() { return input_; }
  /// Of each key frame, as published.
  void note(const stereo_descriptor_vo::PlaceInfo& info) {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_ = info;
  }

  /// The session began anew, with no places or with loaded ones.
  void restart() {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_.reset();
  }

 private:
  Findings judge(Values& values) {
    const std::lock_guard<std::mutex> lock(mutex_);
    Finding finding{Verdict::kOk, last_ ? "recognising places" : "no key frame yet"};
    if (const auto silence = input_.silence())
      finding = silence->asWarning();  // the fault is the odometry's
    else if (last_ && !last_->located)
      finding = {Verdict::kWarn,
                 "no recognised place shows yet where in the map the robot is: map -> odom is that of initialpose, or "
                 "missing",
                 "drive where the robot has been, or give a pose on initialpose"};
    Findings findings = unused_.judge(std::move(finding), values);
    if (!last_) return findings;
    values.add("places", last_->places);
    values.add("loops", last_->loops);
    values.add("memory [MB]", text(1, 1e-6 * static_cast<double>(last_->bytes)));
    values.add("key frame", last_->id);
    values.add("no loop there, because", last_->reason);
    values.add("find time [s]", last_->find_time);
    values.add("verify time [s]", last_->verify_time);
    values.add("optimise time [s]", last_->optimise_time);
    return findings;
  }

  UnusedInput& unused_;
  InputMonitor input_;
  std::mutex mutex_;
  std::optional<stereo_descriptor_vo::PlaceInfo> last_;

  WallUpdater updater_;
};

}  // namespace sdvo
