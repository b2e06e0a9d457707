#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include <string>
#include <utility>

namespace sdvo {

/// /diagnostics once a second of wall time: simulated time stands still when a bag has ended, which is what diagnostics
/// are there to tell. To be declared after what its tasks refer to.
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
  void add(const std::string& task, Owner* owner, void (Owner::*diagnose)(Status&)) {
    updater_.add(task, owner, diagnose);
  }

 private:
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
};

}  // namespace sdvo
