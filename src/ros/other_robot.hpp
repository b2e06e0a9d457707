#pragma once

#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceMatch.h>
#include <stereo_descriptor_vo/PlaceSignature.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "place_conversions.hpp"
#include "report_throttle.hpp"
#include "worker.hpp"

namespace sdvo {

/// Looks another robot's key frames up among ours: its signatures come on other/place_signature, its rows are asked for
/// (other/get_place) when one of our places looks alike.
class OtherRobot {
 public:
  using SignatureMessage = stereo_descriptor_vo::PlaceSignature;

  /// What it must know of our places. Called from a thread of its own; may throw std::invalid_argument.
  struct Places {
    std::function<std::vector<PlaceCandidate>(const SignatureMessage&)> find;  ///< the best first
    /// What geometry says of one of ours and the other's; nothing while it is not the same place.
    std::function<std::optional<stereo_descriptor_vo::PlaceMatch>(int place, const Place& other)> verify;
    std::function<void(const stereo_descriptor_vo::PlaceMatch&)> publish;
    std::function<void(const std::string&)> warn;
  };

  /// `robot`: our own name, whose signatures are no other's. `min_score` of a place for which rows are asked for;
  /// `timeout`: s of wall time for the answer.
  OtherRobot(ros::NodeHandle& nh, const std::string& robot, double min_score, double timeout, Places places);
  ~OtherRobot() { stop(); }

  /// Returns when its thread has ended; an answer that is waited for is given up. No callback may run any more.
  void stop();

 private:
  void handle(const SignatureMessage& signature);
  std::optional<Place> fetch(const SignatureMessage& signature);
  bool isCalling();
  void watch();
  void giveUp();

  const std::string robot_;
  const double min_score_, timeout_;
  const Places places_;
  ReportThrottle throttle_;
  ros::NodeHandle nh_;

  // A call of a service blocks for as long as the other side likes; dropping its connection ends it.
  std::mutex call_mutex_;
  ros::ServiceClient client_;
  std::optional<std::chrono::steady_clock::time_point> deadline_;
  std::atomic<bool> stopping_{false};

  Worker<SignatureMessage::ConstPtr> worker_;
  ros::Subscriber subscriber_;
  ros::WallTimer watchdog_;
};

}  // namespace sdvo
