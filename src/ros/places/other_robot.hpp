#pragma once

#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceMatch.h>
#include <stereo_descriptor_vo/PlaceRequest.h>
#include <stereo_descriptor_vo/PlaceSignature.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../publishers/place_publisher.hpp"
#include "place_session.hpp"

namespace sdvo {

/// Recognises another robot's key frames among our places, and answers its requests. It publishes signatures on
/// other/place_signature. If one of our places looks similar, its features are requested (other/place_request) and come
/// on other/place_answer. Its requests come on place_request and are answered on place_answer. All in callbacks of one
/// thread, which never waits.
class OtherRobot {
 public:
  using SignatureMessage = stereo_descriptor_vo::PlaceSignature;
  using PlaceMessage = stereo_descriptor_vo::Place;

  /// One of a kind now and then.
  using Warn = std::function<void(const std::string& what, const std::string& kind)>;

  /// `robot`: our own name, whose signatures are refused. Callbacks run in the queue of `nh`.
  OtherRobot(ros::NodeHandle& nh, const std::string& robot, SharedSession& ours, PlacePublisher& publisher, Warn warn)
      : robot_(robot), ours_(ours), publisher_(publisher), warn_(std::move(warn)) {
    using Request = stereo_descriptor_vo::PlaceRequest;
    constexpr int kQueue = 20;
    requests_ = nh.advertise<Request>("other/place_request", kQueue);
    answers_ = nh.advertise<PlaceMessage>("place_answer", kQueue);
    subscribers_ = {
        nh.subscribe<SignatureMessage>("other/place_signature", kQueue,
                                       [this](const SignatureMessage::ConstPtr& m) { onSignature(*m); }),
        nh.subscribe<PlaceMessage>("other/place_answer", kQueue,
                                   [this](const PlaceMessage::ConstPtr& m) { onAnswer(*m); }),
        nh.subscribe<Request>("place_request", kQueue, [this](const Request::ConstPtr& m) { onRequest(*m); })};
  }

 private:
  static constexpr double kLeastScore = 0.05;  // likeness from which the other robot is asked for its features (chosen)
  static constexpr double kTimeout = 2.0;      // s of wall time in which it must answer (chosen)

  /// A request without an answer yet, and our places that look similar.
  struct Question {
    std::vector<PlaceCandidate> candidates;
    ros::SteadyTime deadline;
  };

  void onSignature(const SignatureMessage& signature) try {
    if (signature.robot == robot_)
      throw std::invalid_argument("it has this robot's name: `other` is this robot's namespace, or set robot_name");
    giveUpWhatIsLate();
    const std::lock_guard<std::mutex> lock(ours_.mutex);
    std::vector<PlaceCandidate> candidates = ours_.session->find(signature);
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                    [](const PlaceCandidate& candidate) { return candidate.score < kLeastScore; }),
                     candidates.end());
    if (candidates.empty()) return;
    questions_[{signature.robot, signature.id}] = {std::move(candidates),
                                                   ros::SteadyTime::now() + ros::WallDuration(kTimeout)};
    stereo_descriptor_vo::PlaceRequest request;
    request.robot = signature.robot;
    request.id = signature.id;
    request.requested_by = robot_;
    requests_.publish(request);
  } catch (const std::exception& e) {
    warn_("key frame of " + signature.robot + " skipped: " + e.what(), e.what());
  }

  void onRequest(const stereo_descriptor_vo::PlaceRequest& request) try {
    if (request.robot != robot_) return;
    const std::lock_guard<std::mutex> lock(ours_.mutex);
    if (const auto place = ours_.session->message(static_cast<int>(request.id), robot_)) answers_.publish(*place);
  } catch (const std::exception& e) {
    warn_("key frame " + std::to_string(request.id) + " is not sent: " + e.what(), e.what());
  }

  void onAnswer(const PlaceMessage& answer) try {
    const auto asked = questions_.find({answer.robot, answer.id});
    if (asked == questions_.end()) return;  // requested by another robot, or too late
    const Question question = std::move(asked->second);
    questions_.erase(asked);
    const Place other = ros_conversions::fromMessage(answer);
    const std::lock_guard<std::mutex> lock(ours_.mutex);
    for (const PlaceCandidate& candidate : question.candidates) {
      auto match = ours_.session->verify(candidate.place, other);
      if (!match) continue;
      match->robot = robot_;
      match->other_robot = answer.robot;
      publisher_.publish(*match);
      return;
    }
  } catch (const std::exception& e) {
    warn_("key frame of " + answer.robot + " skipped: " + e.what(), e.what());
  }

  void giveUpWhatIsLate() {
    const ros::SteadyTime now = ros::SteadyTime::now();
    for (auto question = questions_.begin(); question != questions_.end();) {
      const auto next = std::next(question);
      if (now > question->second.deadline) {
        const std::string& robot = question->first.first;
        warn_("key frame of " + robot + " skipped: it gives no answer on " + subscribers_[1].getTopic(),
              "no answer of " + robot);
        questions_.erase(question);
      }
      question = next;
    }
  }

  const std::string robot_;
  SharedSession& ours_;
  PlacePublisher& publisher_;
  const Warn warn_;
  std::map<std::pair<std::string, std::uint32_t>, Question> questions_;  ///< by robot and place
  ros::Publisher requests_, answers_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace sdvo
