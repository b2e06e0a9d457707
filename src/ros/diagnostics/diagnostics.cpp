#include "diagnostics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../../check/row_check.hpp"
#include "../../common/text.hpp"
#include "../../messages/stamps.hpp"

namespace sdvo {
namespace {

constexpr const char* kNoPairs = "no pairs";  // the task "input rate" has the reason

/// With the rate and silence that the image side's max_rate leads to; the rate with a tolerance of a tenth, as in
/// RateOptions.
OdometryOutputOptions expected(const ros::NodeHandle& nh, OdometryOutputOptions options) {
  const double limit = nh.param("stereo_features/max_rate", 0.0);
  if (limit <= 0.0) return options;
  options.rates.min_rate = std::min(options.rates.min_rate, 0.9 * limit);
  options.max_silence = std::max(options.max_silence, 2.0 / limit);
  return options;
}

}  // namespace

void WallUpdater::print(const Findings& findings, Status& status) {
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

ImageDiagnostics::ImageDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
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

void ImageDiagnostics::note(const StereoFeatures& features) {
  const std::lock_guard<std::mutex> lock(mutex_);
  exposures_.add(features.report.mean_intensity[0]);
  last_ = features.report;
  last_count_ = features.count();
  refusals_.add(features.report);
}

void ImageDiagnostics::noteFailure(const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  failure_ = why;
}

Findings ImageDiagnostics::judgeSynchronisation(Values& values) {
  return unused_.judge(arrivals_.checkPairs(ros::SteadyTime::now().toSec(), thresholds_.max_gap, values), values);
}

Findings ImageDiagnostics::judgeExposure(Values& values) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (arrivals_.pairs().silence()) return {{Verdict::kOk, kNoPairs}};
  if (!last_ || (refusals_.pairs() == 0 && !failure_.empty())) return {{Verdict::kOk, "no pair was used"}};
  const double left = last_->mean_intensity[0], right = last_->mean_intensity[1];
  values.add("mean grey level", text(1, left, " left, ", right, " right"));
  values.add("sharpness [grey levels a px]", text(2, last_->sharpness[0], " left, ", last_->sharpness[1], " right"));
  return {checkExposure(std::min(left, right), std::max(left, right), exposures_.takeTurns(), thresholds_.min_intensity,
                        thresholds_.max_intensity)
              .asWarning()};
}

Findings ImageDiagnostics::judgeFeatures(Values& values) {
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

OdometryDiagnostics::OdometryDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                         const OdometryOutputOptions& options, UnusedInput& unused)
    : max_latency_(options.max_latency),
      unused_(unused),
      input_("features", nh.resolveName("stereo_features"), expected(nh, options).max_silence,
             expected(nh, options).rates),
      load_(options.max_load),
      updater_(nh, private_nh, name) {
  updater_.add("odometry", this, &OdometryDiagnostics::judge);
  updater_.add("input rate", this, &OdometryDiagnostics::judgeInput);
  updater_.add("load", &load_, &WorkLoad::judge);
  updater_.add("latency", this, &OdometryDiagnostics::judgeLatency);
}

void OdometryDiagnostics::note(const stereo_descriptor_vo::VoInfo& info) {
  load_.noteDropped(info.dropped_features);
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = info;
  input_.note(nanoseconds(info.header.stamp));  // under the lock, so that no task sees an input without its state
}

Findings OdometryDiagnostics::judge(Values& values) {
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

Findings OdometryDiagnostics::judgeInput(Values& values) {
  return unused_.judge(input_.judge(values).front(), values);
}

Findings OdometryDiagnostics::judgeLatency(Values&) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (input_.silence() || !last_ || last_->state == "WAITING") return {{Verdict::kOk, "no pose"}};
  return {checkLatency(last_->latency, max_latency_)};
}

/// Under the lock.
void OdometryDiagnostics::addValues(Values& values) const {
  values.add("epoch", last_->epoch);
  values.add("features", last_->features);
  values.add("matches", last_->matches);
  values.add("inliers", last_->inliers);
  values.add("rms reprojection error [px]", last_->rms_reprojection_error);
  values.add("distance [m]", last_->distance);
  if (std::isfinite(last_->disparity_offset))
    values.add("calibration", text(2, "disparities are off by ", last_->disparity_offset, " +- ",
                                   last_->disparity_offset_sigma, " px in the centre, another ", last_->disparity_bend,
                                   " +- ", last_->disparity_bend_sigma, " px at 45 degrees"));
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

PlaceDiagnostics::PlaceDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                   const std::string& input, double max_silence, UnusedInput& unused)
    : unused_(unused), input_("pairs with odometry", input, max_silence, {}), updater_(nh, private_nh, name) {
  updater_.add("places", this, &PlaceDiagnostics::judge);
}

void PlaceDiagnostics::note(const stereo_descriptor_vo::PlaceInfo& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = info;
}

void PlaceDiagnostics::restart() {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_.reset();
}

Findings PlaceDiagnostics::judge(Values& values) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Finding finding{Verdict::kOk, last_ ? "recognising places" : "no key frame yet"};
  if (const auto silence = input_.silence())
    finding = silence->asWarning();  // the fault is the odometry's
  else if (last_ && !last_->located)
    finding = {Verdict::kWarn,
               "none of the places that were loaded has been recognised yet, so there is no map -> odom",
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

}  // namespace sdvo
