#include "other_robot.hpp"

#include <ros/service.h>
#include <stereo_descriptor_vo/GetPlace.h>

#include <stdexcept>
#include <thread>
#include <utility>

namespace sdvo {

namespace msgs = stereo_descriptor_vo;

namespace {

constexpr const char* kService = "other/get_place";
constexpr std::size_t kWaiting = 20;   ///< signatures, while an answer is waited for
constexpr double kWatchPeriod = 0.05;  ///< s

}  // namespace

OtherRobot::OtherRobot(ros::NodeHandle& nh, const std::string& robot, double min_score, double timeout, Places places)
    : robot_(robot),
      min_score_(min_score),
      timeout_(timeout),
      places_(std::move(places)),
      nh_(nh),
      worker_(kWaiting, [this](const SignatureMessage::ConstPtr& signature) { handle(*signature); }) {
  subscriber_ = nh_.subscribe<SignatureMessage>("other/place_signature", kWaiting,
                                                [this](const SignatureMessage::ConstPtr& signature) {
                                                  if (signature->robot != robot_) worker_.push(signature);
                                                });
  watchdog_ = nh_.createWallTimer(ros::WallDuration(kWatchPeriod), [this](const ros::WallTimerEvent&) { watch(); });
}

void OtherRobot::stop() {
  stopping_ = true;
  std::thread unblock([this] { worker_.stop(); });
  // The call may be about to begin.
  while (isCalling()) {
    giveUp();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  unblock.join();
}

bool OtherRobot::isCalling() {
  const std::lock_guard<std::mutex> lock(call_mutex_);
  return deadline_.has_value();
}

void OtherRobot::watch() {
  {
    const std::lock_guard<std::mutex> lock(call_mutex_);
    if (!deadline_ || std::chrono::steady_clock::now() < *deadline_) return;
  }
  giveUp();
}

void OtherRobot::giveUp() {
  const std::lock_guard<std::mutex> lock(call_mutex_);
  client_.shutdown();
}

/// In the worker's thread.
void OtherRobot::handle(const SignatureMessage& signature) try {
  std::optional<Place> other;
  for (const PlaceCandidate& candidate : places_.find(signature)) {
    if (candidate.score < min_score_) return;
    if (!other) other = fetch(signature);
    if (!other) return;
    std::optional<msgs::PlaceMatch> match = places_.verify(candidate.place, *other);
    if (!match) continue;
    match->robot = robot_;
    match->other_robot = signature.robot;
    places_.publish(*match);
    return;
  }
} catch (const std::exception& e) {
  if (throttle_.allows(e.what())) places_.warn("key frame of " + signature.robot + " skipped: " + e.what());
}

/// Throws std::runtime_error where the other robot does not answer, or not with that place.
std::optional<Place> OtherRobot::fetch(const SignatureMessage& signature) {
  const std::string service = nh_.resolveName(kService);
  msgs::GetPlace call;
  call.request.id = signature.id;
  ros::ServiceClient client = nh_.serviceClient<msgs::GetPlace>(kService, true);
  {
    const std::lock_guard<std::mutex> lock(call_mutex_);
    if (stopping_) return std::nullopt;
    client_ = client;
    deadline_ = std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                                       std::chrono::duration<double>(timeout_));
  }
  const bool is_answered = client.isValid() && client.call(call);
  bool is_late;
  {
    const std::lock_guard<std::mutex> lock(call_mutex_);
    is_late = std::chrono::steady_clock::now() >= *deadline_;
    deadline_.reset();
    client_ = ros::ServiceClient();
  }
  if (stopping_) return std::nullopt;
  if (!is_answered)
    throw std::runtime_error("service " + service + (is_late ? " gives no answer in time" : " is not there or fails"));
  if (!call.response.success) throw std::runtime_error("service " + service + ": " + call.response.message);
  return ros_conversions::fromMessage(call.response.place);
}

}  // namespace sdvo
