#include "place_diagnostics.hpp"

#include <algorithm>

namespace sdvo {

using Level = WallUpdater::Level;

PlaceDiagnostics::PlaceDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                   const std::string& input, double max_silence)
    : input_("pairs with odometry", input, max_silence, {}), updater_(nh, private_nh, name) {
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

/// Under the lock. Without odometry places can do nothing, but it is no fault of theirs.
void PlaceDiagnostics::summarise(Status& status) const {
  if (const auto silence = input_.silence())
    status.summary(std::min<int>(silence->level, Level::WARN), silence->text);
  else if (last_ && !last_->located)
    status.summary(
        Level::WARN,
        "none of the places that were loaded has been recognised yet, so there is no map -> odom: drive where the "
        "robot has been, or give a pose on /initialpose");
  else
    status.summary(Level::OK, last_ ? "recognising places" : "no key frame yet");
}

}  // namespace sdvo
