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

#include "../messages/place_conversions.hpp"

namespace sdvo {

/// Looks another robot's key frames up among ours, and lets it do the same. Its signatures come on
/// other/place_signature; when one of our places looks alike its rows are asked for (other/place_request) and come on
/// other/place_answer. Its own requests come on place_request, and the rows go out on place_answer. Nothing waits: one
/// thread's callbacks do it all.
class OtherRobot {
 public:
  using SignatureMessage = stereo_descriptor_vo::PlaceSignature;
  using PlaceMessage = stereo_descriptor_vo::Place;

  /// What it must know of our places; may throw std::invalid_argument.
  struct Places {
    std::function<std::vector<PlaceCandidate>(const SignatureMessage&)> find;  ///< the best first
    /// What geometry says of one of ours and the other's; nothing while it is not the same place.
    std::function<std::optional<stereo_descriptor_vo::PlaceMatch>(int place, const Place& other)> verify;
    std::function<std::optional<PlaceMessage>(int place)> get;  ///< nothing when it is not there any more
    std::function<void(const stereo_descriptor_vo::PlaceMatch&)> publish;
    std::function<void(const std::string& what, const std::string& kind)> warn;  ///< one of a kind now and then
  };

  /// `robot`: our own name, whose signatures are no other's. `min_score` of a place for which rows are asked for;
  /// `timeout`: s of wall time for the answer. Callbacks run where `nh` has them.
  OtherRobot(ros::NodeHandle& nh, const std::string& robot, double min_score, double timeout, Places places);

 private:
  /// Rows that were asked for, and the places of ours that may be the same.
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
