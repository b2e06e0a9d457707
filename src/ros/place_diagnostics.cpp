#include "place_diagnostics.hpp"

namespace sdvo {

using Level = diagnostic_msgs::DiagnosticStatus;

PlaceDiagnostics::PlaceDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                   const std::string& input, double max_silence)
    : input_(input), max_silence_(max_silence), updater_(nh, private_nh, name) {
  updater_.setHardwareID("none");
  updater_.add("places", this, &PlaceDiagnostics::diagnose);
  // By wall time: the simulated one stands still when a bag has ended, which is what diagnostics are there to tell.
  timer_ = nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { updater_.force_update(); });
}

void PlaceDiagnostics::notePair() {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_pair_ = std::chrono::steady_clock::now();
}

void PlaceDiagnostics::note(const stereo_descriptor_vo::PlaceInfo& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = info;
}

void PlaceDiagnostics::restart() {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_.reset();
}

void PlaceDiagnostics::notePaused(bool is_paused) {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_paused_ = is_paused;
}

void PlaceDiagnostics::diagnose(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  summarise(status);
  if (!last_) return;
  status.add("places", last_->places);
  status.add("loops", last_->loops);
  status.addf("memory [MB]", "%.1f", 1e-6 * static_cast<double>(last_->bytes));
  status.add("key frame", last_->id);
  status.add("no loop there, because", last_->reason);
  status.add("find time [s]", last_->find_time);
  status.add("verify time [s]", last_->verify_time);
  status.add("optimise time [s]", last_->optimise_time);
  status.add("dropped pairs", last_->dropped_pairs);
  status.add("unpaired", last_->unpaired);
  status.add("malformed", last_->malformed);
}

/// Under the lock.
void PlaceDiagnostics::summarise(Status& status) const {
  if (is_paused_) {
    status.summary(Level::WARN, "paused");
    return;
  }
  if (!last_pair_) {
    status.summary(Level::WARN, "no pair yet on " + input_);
    return;
  }
  const double silence = std::chrono::duration<double>(std::chrono::steady_clock::now() - *last_pair_).count();
  status.addf("age of the last pair [s]", "%.1f", silence);
  if (silence > max_silence_)
    status.summaryf(Level::WARN, "no pair with odometry for %.0f s on %s", silence, input_.c_str());
  else if (last_ && !last_->located)
    status.summary(Level::WARN, "none of the places that were loaded has been recognised yet: no map -> odom");
  else
    status.summary(Level::OK, last_ ? "recognising places" : "no key frame yet");
}

}  // namespace sdvo
