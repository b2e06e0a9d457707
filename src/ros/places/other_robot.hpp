#pragma once

#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceMatch.h>
#include <stereo_descriptor_vo/PlaceRequest.h>
#include <stereo_descriptor_vo/PlaceSignature.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "../../messages/place_conversions.hpp"

namespace sdvo {

/// Recognises another robot's key frames among our places, and answers its requests. It publishes signatures on
/// other/place_signature. If one of our places looks similar, its features are requested (other/place_request) and come
/// on other/place_answer. Its requests come on place_request and are answered on place_answer. All in callbacks of one
/// thread, which never waits.
class OtherRobot {
 public:
  using SignatureMessage = stereo_descriptor_vo::PlaceSignature;
  using PlaceMessage = stereo_descriptor_vo::Place;

  /// Access to our places. Functions may throw std::invalid_argument.
  struct Places {
    std::function<std::vector<PlaceCandidate>(const SignatureMessage&)> find;  ///< the best first
    /// Geometric match of one of our places with the other robot's; nothing if they are not the same place.
    std::function<std::optional<stereo_descriptor_vo::PlaceMatch>(int place, const Place& other)> verify;
    std::function<std::optional<PlaceMessage>(int place)> get;  ///< nothing if the place was forgotten
    std::function<void(const stereo_descriptor_vo::PlaceMatch&)> publish;
    std::function<void(const std::string& what, const std::string& kind)> warn;  ///< one of a kind now and then
  };

  /// `robot`: our own name, whose signatures are refused. `min_score`: similarity above which features are requested.
  /// `timeout`: s of wall time for the answer. Callbacks run in the queue of `nh`.
  OtherRobot(ros::NodeHandle& nh, const std::string& robot, double min_score, double timeout, Places places);

 private:
  /// A request without an answer yet, and our places that look similar.
  struct Question {
    std::vector<PlaceCandidate> candidates;
    ros::SteadyTime deadline;
  };

  void onSignature(const SignatureMessage& signature);
  void onRequest(const stereo_descriptor_vo::PlaceRequest& request);
  void onAnswer(const PlaceMessage& answer);
  void giveUpWhatIsLate();

  const std::string robot_;
  const double min_score_, timeout_;
  const Places places_;
  std::map<std::pair<std::string, std::uint32_t>, Question> questions_;  ///< by robot and place
  ros::Publisher requests_, answers_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace sdvo
