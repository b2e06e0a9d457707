#include "other_robot.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace sdvo {

namespace msgs = stereo_descriptor_vo;

OtherRobot::OtherRobot(ros::NodeHandle& nh, const std::string& robot, double min_score, double timeout, Places places)
    : robot_(robot), min_score_(min_score), timeout_(timeout), places_(std::move(places)) {
  constexpr int kQueue = 20;
  requests_ = nh.advertise<msgs::PlaceRequest>("other/place_request", kQueue);
  answers_ = nh.advertise<PlaceMessage>("place_answer", kQueue);
  subscribers_ = {nh.subscribe<SignatureMessage>("other/place_signature", kQueue,
                                                 [this](const SignatureMessage::ConstPtr& m) { onSignature(*m); }),
                  nh.subscribe<PlaceMessage>("other/place_answer", kQueue,
                                             [this](const PlaceMessage::ConstPtr& m) { onAnswer(*m); }),
                  nh.subscribe<msgs::PlaceRequest>("place_request", kQueue,
                                                   [this](const msgs::PlaceRequest::ConstPtr& m) { onRequest(*m); })};
}

void OtherRobot::onSignature(const SignatureMessage& signature) try {
  if (signature.robot == robot_)
    throw std::invalid_argument("it has this robot's name: `other` is this robot's namespace, or set robot_name");
  giveUpWhatIsLate();
  std::vector<PlaceCandidate> candidates = places_.find(signature);
  candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                  [this](const PlaceCandidate& candidate) { return candidate.score < min_score_; }),
                   candidates.end());
  if (candidates.empty()) return;
  questions_[{signature.robot, signature.id}] = {std::move(candidates),
                                                 ros::SteadyTime::now() + ros::WallDuration(timeout_)};
  msgs::PlaceRequest request;
  request.robot = signature.robot;
  request.id = signature.id;
  request.requested_by = robot_;
  requests_.publish(request);
} catch (const std::exception& e) {
  places_.warn("key frame of " + signature.robot + " skipped: " + e.what(), e.what());
}

void OtherRobot::giveUpWhatIsLate() {
  const ros::SteadyTime now = ros::SteadyTime::now();
  for (auto question = questions_.begin(); question != questions_.end();) {
    const auto next = std::next(question);
    if (now > question->second.deadline) {
      const std::string& robot = question->first.first;
      places_.warn("key frame of " + robot + " skipped: it gives no answer on " + subscribers_[1].getTopic(),
                   "no answer of " + robot);
      questions_.erase(question);
    }
    question = next;
  }
}

void OtherRobot::onAnswer(const PlaceMessage& answer) try {
  const auto asked = questions_.find({answer.robot, answer.id});
  if (asked == questions_.end()) return;  // requested by another robot, or too late
  const Question question = std::move(asked->second);
  questions_.erase(asked);
  const Place other = ros_conversions::fromMessage(answer);
  for (const PlaceCandidate& candidate : question.candidates) {
    std::optional<msgs::PlaceMatch> match = places_.verify(candidate.place, other);
    if (!match) continue;
    match->robot = robot_;
    match->other_robot = answer.robot;
    places_.publish(*match);
    return;
  }
} catch (const std::exception& e) {
  places_.warn("key frame of " + answer.robot + " skipped: " + e.what(), e.what());
}

void OtherRobot::onRequest(const msgs::PlaceRequest& request) try {
  if (request.robot != robot_) return;
  if (const std::optional<PlaceMessage> place = places_.get(static_cast<int>(request.id))) answers_.publish(*place);
} catch (const std::exception& e) {
  places_.warn("key frame " + std::to_string(request.id) + " is not sent: " + e.what(), e.what());
}

}  // namespace sdvo
