#include "diagnostics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../check/odometry_check.hpp"
#include "../messages/stamps.hpp"

namespace sdvo {

using Level = WallUpdater::Level;

ImageDiagnostics::ImageDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                   const StereoInputOptions& options, ArrivalLog& arrivals, UnusedInput& unused)
    : thresholds_(options.thresholds),
      arrivals_(arrivals),
      unused_(unused),
      input_("pairs", nh.resolveName("left/image_rect") + " and " + nh.resolveName("right/image_rect"),
             options.max_silence, options.rates),
      load_(options.thresholds.max_load),
      updater_(nh, private_nh, name) {
  updater_.add("input rate", &input_, &InputMonitor::diagnose);
  updater_.add("synchronisation", this, &ImageDiagnostics::diagnoseSynchronisation);
  updater_.add("exposure", this, &ImageDiagnostics::diagnoseExposure);
  updater_.add("features", this, &ImageDiagnostics::diagnoseFeatures);
  updater_.add("load", &load_, &WorkLoad::diagnose);
}

void ImageDiagnostics::notePair(std::int64_t stamp, double gap) {
  input_.note(stamp);
  const std::lock_guard<std::mutex> lock(mutex_);
  largest_gap_ = std::max(largest_gap_, gap);
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

/// Without input there is nothing to say; "input rate" tells why.
bool ImageDiagnostics::isIdle(Status& status) const {
  const auto silence = input_.silence();
  if (silence) status.summary(Level::OK, "no pairs");
  return silence.has_value();
}

void ImageDiagnostics::diagnoseSynchronisation(Status& status) {
  const double now = ros::SteadyTime::now().toSec();
  const std::string loss = arrivals_.explainLoss(now);
  const auto silence = input_.silence();
  const std::lock_guard<std::mutex> lock(mutex_);
  const double gap = std::exchange(largest_gap_, 0.0);
  status.addf("largest gap [ms]", "%.2f", 1e3 * gap);
  for (const auto& [topic, rate] : arrivals_.rates(now)) status.addf("rate of " + topic + " [Hz]", "%.2f", rate);
  if (!loss.empty() && (!silence || silence->level != Level::OK))
    status.summary(Level::WARN, loss);
  else if (silence)
    status.summary(Level::OK, "no pairs");
  else if (gap > thresholds_.max_gap)
    status.summaryf(Level::WARN, "left and right are %.1f ms apart: are the cameras triggered together?", 1e3 * gap);
  else
    status.summary(Level::OK, "left and right belong together");
  unused_.diagnose(status);
}

void ImageDiagnostics::diagnoseExposure(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (isIdle(status)) return;
  if (!last_ || (pairs_ == 0 && !failure_.empty())) return status.summary(Level::OK, "no pair was used");
  const double left = last_->mean_intensity[0], right = last_->mean_intensity[1];
  status.addf("mean grey level", "%.1f left, %.1f right", left, right);
  status.addf("sharpness [grey levels a px]", "%.2f left, %.2f right", last_->sharpness[0], last_->sharpness[1]);
  if (exposures_.takeTurns())
    status.summary(Level::WARN, "exposures take turns from pair to pair, as in HDR: use one exposure");
  else if (std::min(left, right) < thresholds_.min_intensity)
    status.summaryf(Level::WARN, "too dark, expose longer or add light: mean grey levels of %.0f and %.0f", left,
                    right);
  else if (std::max(left, right) > thresholds_.max_intensity)
    status.summaryf(Level::WARN, "too bright, expose less: mean grey levels of %.0f and %.0f", left, right);
  else
    status.summaryf(Level::OK, "mean grey levels of %.0f and %.0f", left, right);
}

void ImageDiagnostics::diagnoseFeatures(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::string failure = std::exchange(failure_, "");
  const int pairs = std::exchange(pairs_, 0), refused = std::exchange(refused_pairs_, 0);
  if (isIdle(status)) return;
  status.add("corners", last_ ? last_->detected : 0);
  status.add("features", last_count_);
  status.add("refused pairs, of the last second", std::to_string(refused) + " of " + std::to_string(pairs));
  if (!failure.empty())
    status.summary(Level::ERROR, failure);
  else if (refused > 0)
    status.summary(Level::ERROR, "left and right are not a rectified pair: " + refused_status_);
  else if (last_ && last_->detected < thresholds_.min_corners)
    status.summaryf(Level::WARN, "only %d corners: little texture, darkness, or out of focus?", last_->detected);
  else if (last_ && !last_->status.empty())
    status.summary(Level::WARN, last_->status);
  else
    status.summaryf(Level::OK, "%d features", last_count_);
}

/// The image side may be told to leave pairs out; with a tenth to either side, as RateOptions.
static RateOptions expectedRates(const ros::NodeHandle& nh, RateOptions rates) {
  const double limit = nh.param("stereo_features/max_rate", 0.0);
  if (limit > 0.0) rates.min_rate = std::min(rates.min_rate, 0.9 * limit);
  return rates;
}

OdometryDiagnostics::OdometryDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                         const OdometryOutputOptions& options, UnusedInput& unused)
    : max_latency_(options.max_latency),
      unused_(unused),
      input_("features", nh.resolveName("stereo_features"), options.max_silence, expectedRates(nh, options.rates)),
      load_(options.max_load),
      updater_(nh, private_nh, name) {
  updater_.add("odometry", this, &OdometryDiagnostics::diagnose);
  updater_.add("input rate", this, &OdometryDiagnostics::diagnoseInput);
  updater_.add("load", &load_, &WorkLoad::diagnose);
  updater_.add("latency", this, &OdometryDiagnostics::diagnoseLatency);
}

void OdometryDiagnostics::note(const stereo_descriptor_vo::VoInfo& info) {
  input_.note(nanoseconds(info.header.stamp));
  load_.noteDropped(info.dropped_features);
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = info;
}

void OdometryDiagnostics::diagnose(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  summarise(status);
  if (!last_) return;
  status.add("epoch", last_->epoch);
  status.add("features", last_->features);
  status.add("matches", last_->matches);
  status.add("inliers", last_->inliers);
  status.add("rms reprojection error [px]", last_->rms_reprojection_error);
  status.add("distance [m]", last_->distance);
  addCalibration(status);
  status.add("latency [s]", last_->latency);
  status.add("dropped pairs", last_->dropped_pairs);
}

void OdometryDiagnostics::diagnoseInput(Status& status) {
  input_.diagnose(status);
  unused_.diagnose(status);
}

std::string doubtOfLatency(double latency, double max_latency) {
  constexpr double kAhead = 0.1;  // s, a step of the slowest simulated clocks (chosen)
  if (std::isnan(latency)) return ": use_sim_time is true, and nobody publishes /clock: rosbag play needs --clock";
  constexpr double kEpoch = 1e7;  // s, a third of a year
  if (latency > kEpoch)
    return ": the images have another clock than this machine: since its boot, or of a recording that is played "
           "without "
           "use_sim_time and --clock?";
  if (latency > max_latency) return ": is the machine too slow, or are the clocks of two machines different?";
  if (latency < -kAhead)
    return ": the images are stamped in the future, where TF knows nothing yet: is the camera's clock that of this "
           "machine?";
  return "";
}

void OdometryDiagnostics::diagnoseLatency(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (input_.silence() || !last_ || last_->state == "WAITING") return status.summary(Level::OK, "no pose");
  const std::string doubt = doubtOfLatency(last_->latency, max_latency_);
  status.summaryf(doubt.empty() ? Level::OK : Level::WARN, "%.3f s from image to pose%s", last_->latency,
                  doubt.c_str());
}

/// Under the lock, as what follows.
void OdometryDiagnostics::summarise(Status& status) const {
  if (const auto silence = input_.silence()) {
    const bool is_known = silence->level != Level::OK && last_;
    status.summary(silence->level, silence->text + (is_known ? "; the last state was " + last_->state : ""));
    return;
  }
  const auto level = last_->state == "TRACKING" ? Level::OK : last_->state == "LOST" ? Level::ERROR : Level::WARN;
  status.summary(level, last_->state + (last_->reason.empty() ? "" : ": " + last_->reason));
  const std::string doubt = doubtOfShutters({last_->right_delay, last_->right_delay_sigma});
  if (!doubt.empty()) status.mergeSummary(Level::WARN, doubt);
}

void OdometryDiagnostics::addCalibration(Status& status) const {
  if (std::isfinite(last_->disparity_offset))
    status.addf(
        "calibration", "disparities are off by %.2f +- %.2f px in the centre, another %.2f +- %.2f px at 45 degrees",
        last_->disparity_offset, last_->disparity_offset_sigma, last_->disparity_bend, last_->disparity_bend_sigma);
  if (std::isfinite(last_->right_delay))
    status.addf("right camera delay [ms]", "%.2f +- %.2f", 1e3 * last_->right_delay, 1e3 * last_->right_delay_sigma);
  if (std::isfinite(last_->right_rotation[0]))
    status.addf("right camera rotation [mrad]", "%.2f %.2f %.2f", 1e3 * last_->right_rotation[0],
                1e3 * last_->right_rotation[1], 1e3 * last_->right_rotation[2]);
}

PlaceDiagnostics::PlaceDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                   const std::string& input, double max_silence, UnusedInput& unused)
    : unused_(unused), input_("pairs with odometry", input, max_silence, {}), updater_(nh, private_nh, name) {
  updater_.add("places", this, &PlaceDiagnostics::diagnose);
}

void PlaceDiagnostics::note(const stereo_descriptor_vo::PlaceInfo& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = info;
}

void PlaceDiagnostics::restart() {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_.reset();
}

void PlaceDiagnostics::diagnose(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  summarise(status);
  unused_.diagnose(status);
  if (!last_) return;
  status.add("places", last_->places);
  status.add("loops", last_->loops);
  status.addf("memory [MB]", "%.1f", 1e-6 * static_cast<double>(last_->bytes));
  status.add("key frame", last_->id);
  status.add("no loop there, because", last_->reason);
  status.add("find time [s]", last_->find_time);
  status.add("verify time [s]", last_->verify_time);
  status.add("optimise time [s]", last_->optimise_time);
}

/// Under the lock. Without odometry places can do nothing, but it is no fault of theirs.
void PlaceDiagnostics::summarise(Status& status) const {
  if (const auto silence = input_.silence())
    status.summary(std::min<int>(silence->level, Level::WARN), silence->text);
  else if (last_ && !last_->located)
    status.summary(
        Level::WARN,
        "none of the places that were loaded has been recognised yet, so there is no map -> odom: drive where the "
        "robot has been, or give a pose on initialpose");
  else
    status.summary(Level::OK, last_ ? "recognising places" : "no key frame yet");
}

}  // namespace sdvo
