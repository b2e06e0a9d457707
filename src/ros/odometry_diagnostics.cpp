#include "odometry_diagnostics.hpp"

#include <cmath>

namespace sdvo {

using Level = WallUpdater::Level;

OdometryDiagnostics::OdometryDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                         const OdometryOutputOptions& options)
    : max_latency_(options.max_latency),
      input_("features", nh.resolveName("stereo_features"), options.max_silence, options.rates),
      load_(options.max_load),
      updater_(nh, private_nh, name) {
  updater_.add("odometry", this, &OdometryDiagnostics::diagnose);
  updater_.add("input rate", &input_, &InputMonitor::diagnose);
  updater_.add("load", &load_, &WorkLoad::diagnose);
  updater_.add("latency", this, &OdometryDiagnostics::diagnoseLatency);
}

void OdometryDiagnostics::note(const stereo_descriptor_vo::VoInfo& info) {
  input_.note();
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
  status.add("dropped feature messages", last_->dropped_features);
  status.add("out of order", last_->out_of_order);
  status.add("malformed", last_->malformed);
}

void OdometryDiagnostics::diagnoseLatency(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (input_.silence() || !last_) {
    status.summary(Level::OK, "no features");
    return;
  }
  const bool is_late = last_->latency > max_latency_;
  status.summaryf(is_late ? Level::WARN : Level::OK, "%.3f s from image to pose%s", last_->latency,
                  is_late ? ": is the machine too slow, or are the clocks of two machines different?" : "");
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
