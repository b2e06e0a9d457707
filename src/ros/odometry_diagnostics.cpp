#include "odometry_diagnostics.hpp"

#include <cmath>
#include <limits>

namespace sdvo {

using Level = diagnostic_msgs::DiagnosticStatus;

OdometryDiagnostics::OdometryDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                         const std::string& input, double max_silence)
    : input_(input),
      max_silence_(max_silence),
      min_rate_(0.0),
      max_rate_(std::numeric_limits<double>::infinity()),
      rate_(diagnostic_updater::FrequencyStatusParam(&min_rate_, &max_rate_), "input rate"),
      updater_(nh, private_nh, name) {
  updater_.setHardwareID("none");
  updater_.add("odometry", this, &OdometryDiagnostics::diagnose);
  updater_.add(rate_);
  // By wall time: the simulated one stands still when a bag has ended, which is what diagnostics are there to tell.
  timer_ = nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { updater_.force_update(); });
}

void OdometryDiagnostics::note(const stereo_descriptor_vo::VoInfo& info) {
  rate_.tick();
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = info;
  last_time_ = std::chrono::steady_clock::now();
}

void OdometryDiagnostics::notePaused(bool is_paused) {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_paused_ = is_paused;
}

void OdometryDiagnostics::diagnose(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (is_paused_) {
    status.summary(Level::WARN, "paused");
    return;
  }
  if (!last_) {
    status.summary(Level::WARN, "no features yet on " + input_);
    return;
  }
  summarise(status);
  status.add("epoch", last_->epoch);
  status.add("features", last_->features);
  status.add("matches", last_->matches);
  status.add("inliers", last_->inliers);
  status.add("rms reprojection error [px]", last_->rms_reprojection_error);
  status.add("distance [m]", last_->distance);
  addCalibration(status);
  status.add("latency [s]", last_->latency);
  status.add("dropped pairs", last_->dropped_pairs);
  status.add("dropped feature messages", last_->dropped_features);
  status.add("out of order", last_->out_of_order);
  status.add("malformed", last_->malformed);
}

/// Under the lock, as what follows.
void OdometryDiagnostics::summarise(Status& status) const {
  const double silence = std::chrono::duration<double>(std::chrono::steady_clock::now() - last_time_).count();
  status.addf("age of the last pair [s]", "%.1f", silence);
  if (silence > max_silence_) {
    status.summaryf(Level::ERROR, "no features for %.0f s on %s; the last state was %s", silence, input_.c_str(),
                    last_->state.c_str());
    return;
  }
  const auto level = last_->state == "TRACKING" ? Level::OK : last_->state == "LOST" ? Level::ERROR : Level::WARN;
  status.summary(level, last_->state + (last_->reason.empty() ? "" : ": " + last_->reason));
}

void OdometryDiagnostics::addCalibration(Status& status) const {
  if (std::isfinite(last_->disparity_offset))
    status.addf(
        "calibration", "disparities are off by %.2f +- %.2f px in the centre, another %.2f +- %.2f px at 45 degrees",
        last_->disparity_offset, last_->disparity_offset_sigma, last_->disparity_bend, last_->disparity_bend_sigma);
  if (std::isfinite(last_->right_rotation[0]))
    status.addf("right camera rotation [mrad]", "%.2f %.2f %.2f", 1e3 * last_->right_rotation[0],
                1e3 * last_->right_rotation[1], 1e3 * last_->right_rotation[2]);
}

}  // namespace sdvo
