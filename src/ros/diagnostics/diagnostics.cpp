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

/// The image side's max_rate lowers the expected rate, with a tolerance of a tenth as in RateOptions.
RateOptions expectedRates(const ros::NodeHandle& nh, RateOptions rates) {
  const double limit = nh.param("stereo_features/max_rate", 0.0);
  if (limit > 0.0) rates.min_rate = std::min(rates.min_rate, 0.9 * limit);
  return rates;
}

}  // namespace

Finding checkLatency(double latency, double most) {
  constexpr double kEpoch = 1e7;  // s, a third of a year
  constexpr double kAhead = 0.1;  // s, a step of the slowest simulated clocks (chosen)
  const std::string what = text(3, latency, " s from image to pose");
  if (std::isnan(latency))
    return {Verdict::kWarn, what, "use_sim_time is true, and nobody publishes /clock: rosbag play needs --clock"};
  if (latency > kEpoch)
    return {Verdict::kWarn, what,
            "the images have another clock than this machine: since its boot, or of a recording that is played "
            "without use_sim_time and --clock?"};
  if (latency > most)
    return {Verdict::kWarn, what, "is the machine too slow, or are the clocks of two machines different?"};
  return judged(false, latency < -kAhead, what,
                "the images are stamped in the future, where TF knows nothing yet: is the camera's clock that of this "
                "machine?");
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
  ++pairs_;
  refused_pairs_ += features.report.refused;
  if (features.report.refused) refused_status_ = features.report.status;
}

void ImageDiagnostics::noteFailure(const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  failure_ = why;
}

Findings ImageDiagnostics::judgeSynchronisation(Status& values) {
  const double now = ros::SteadyTime::now().toSec();
  const std::string loss = arrivals_.explainLoss(now);
  const auto silence = arrivals_.pairs().silence();
  const double gap = arrivals_.takeLargestGap();
  values.add("largest gap [ms]", text(2, 1e3 * gap));
  for (const auto& [topic, rate] : arrivals_.rates(now)) values.add("rate of " + topic + " [Hz]", text(2, rate));
  Finding finding{Verdict::kOk, silence ? kNoPairs : "left and right belong together"};
  if (!loss.empty() && (!silence || silence->isFault()))
    finding = {Verdict::kWarn, loss};
  else if (!silence && gap > thresholds_.max_gap)
    finding = {Verdict::kWarn, text(1, "left and right are ", 1e3 * gap, " ms apart"),
               "are the cameras triggered together?"};
  return unused_.judge(std::move(finding), values);
}

Findings ImageDiagnostics::judgeExposure(Status& values) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (arrivals_.pairs().silence()) return {{Verdict::kOk, kNoPairs}};
  if (!last_ || (pairs_ == 0 && !failure_.empty())) return {{Verdict::kOk, "no pair was used"}};
  const double left = last_->mean_intensity[0], right = last_->mean_intensity[1];
  values.add("mean grey level", text(1, left, " left, ", right, " right"));
  values.add("sharpness [grey levels a px]", text(2, last_->sharpness[0], " left, ", last_->sharpness[1], " right"));
  return {checkExposure(std::min(left, right), std::max(left, right), exposures_.takeTurns(), thresholds_.min_intensity,
                        thresholds_.max_intensity)
              .asWarning()};
}

Findings ImageDiagnostics::judgeFeatures(Status& values) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::string failure = std::exchange(failure_, "");
  const int pairs = std::exchange(pairs_, 0), refused = std::exchange(refused_pairs_, 0);
  if (arrivals_.pairs().silence()) return {{Verdict::kOk, kNoPairs}};
  values.add("corners", last_ ? last_->detected : 0);
  values.add("features", last_count_);
  values.add("refused pairs, of the last second", text(0, refused, " of ", pairs));
  if (!failure.empty()) return {{Verdict::kFail, failure}};
  if (refused > 0) return {{Verdict::kFail, "left and right are not a rectified pair", refused_status_}};
  if (last_ && last_->detected < thresholds_.min_corners)
    return {
        {Verdict::kWarn, text(0, "only ", last_->detected, " corners"), "little texture, darkness, or out of focus?"}};
  if (last_ && !last_->status.empty()) return {{Verdict::kWarn, last_->status}};
  return {{Verdict::kOk, text(0, last_count_, " features")}};
}

OdometryDiagnostics::OdometryDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                         const OdometryOutputOptions& options, UnusedInput& unused)
    : max_latency_(options.max_latency),
      unused_(unused),
      input_("features", nh.resolveName("stereo_features"), options.max_silence, expectedRates(nh, options.rates)),
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

Findings OdometryDiagnostics::judge(Status& values) {
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

Findings OdometryDiagnostics::judgeInput(Status& values) {
  return unused_.judge(input_.judge(values).front(), values);
}

Findings OdometryDiagnostics::judgeLatency(Status&) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (input_.silence() || !last_ || last_->state == "WAITING") return {{Verdict::kOk, "no pose"}};
  return {checkLatency(last_->latency, max_latency_)};
}

/// Under the lock.
void OdometryDiagnostics::addValues(Status& values) const {
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
  if (std::isfinite(last_->right_rotation[0]))
    values.add("right camera rotation [mrad]", text(2, 1e3 * last_->right_rotation[0], " ", 1e3 * last_->right_rotation[1],
                                                    " ", 1e3 * last_->right_rotation[2]));
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

Findings PlaceDiagnostics::judge(Status& values) {
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
