#pragma once

#include <nav_msgs/Odometry.h>
#include <ros/node_handle.h>
#include <stereo_descriptor_vo/StereoFeatures.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <functional>
#include <memory>
#include <string>

#include "../../check/unused_input.hpp"
#include "../node/threads.hpp"
#include "synchronisers.hpp"

namespace sdvo {

/// The three messages of one pair, which have one stamp.
struct OdometryPair {
  stereo_descriptor_vo::StereoFeatures::ConstPtr features;
  nav_msgs::Odometry::ConstPtr odometry;
  stereo_descriptor_vo::VoInfo::ConstPtr info;
  int resumes = 0;  ///< number of resumes of the subscription before it arrived
};

/// Synchronised topics `stereo_features`, `odom` and `vo_info`. For the thread of its callbacks.
class OdometryPairInput {
 public:
  using Callback = std::function<void(const OdometryPair&)>;
  /// For a message that is not used, with the reason.
  using Refusal = std::function<void(const std::string& topic, const ros::Time& stamp, const std::string& why)>;

  /// `queue_size`: incomplete pairs that wait. Refused messages count as `unused`, and incomplete pairs unless the
  /// odometry had no pose, or is paused and says nothing.
  OdometryPairInput(const ros::NodeHandle& nh, int queue_size, UnusedInput& unused, Callback callback, Refusal refuse);

  /// While they are paused the image side has one listener less.
  PausableInput& subscriptions() { return subscriptions_; }

  /// Names of the topics, for people.
  std::string topics() const;

 private:
  using Features = stereo_descriptor_vo::StereoFeatures;
  using Odometry = nav_msgs::Odometry;
  using Info = stereo_descriptor_vo::VoInfo;
  using Synchroniser = TriggerSynchroniser<Features, Odometry, Info>;

  std::unique_ptr<Synchroniser> makeSynchroniser();
  template <int input, class Message>
  ros::Subscriber subscribe(const std::string& topic);
  template <int input, class Message>
  void take(const std::string& topic, const boost::shared_ptr<const Message>& message);

  ros::NodeHandle nh_;
  const int queue_size_;
  const Callback callback_;
  const Refusal refuse_;
  UnusedInput& unused_;
  int resumes_ = 0;
  std::unique_ptr<Synchroniser> synchroniser_;
  PausableInput subscriptions_;
};

}  // namespace sdvo
