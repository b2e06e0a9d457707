#pragma once

#include <nav_msgs/Odometry.h>
#include <ros/node_handle.h>
#include <stereo_descriptor_vo/StereoFeatures.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

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
  OdometryPairInput(const ros::NodeHandle& nh, int queue_size, UnusedInput& unused, Callback callback, Refusal refuse)
      : nh_(nh),
        queue_size_(queue_size),
        callback_(std::move(callback)),
        refuse_(std::move(refuse)),
        unused_(unused),
        synchroniser_(makeSynchroniser()),
        subscriptions_(
            [this] {
              return std::vector<ros::Subscriber>{subscribe<0, Features>("stereo_features"),
                                                  subscribe<1, Odometry>("odom"), subscribe<2, Info>("vo_info")};
            },
            [this] {
              ++resumes_;
              synchroniser_ = makeSynchroniser();
            }) {}

  /// While they are paused the image side has one listener less.
  PausableInput& subscriptions() { return subscriptions_; }

  /// Names of the topics, for people.
  std::string topics() const {
    return nh_.resolveName("stereo_features") + ", " + nh_.resolveName("odom") + " and " + nh_.resolveName("vo_info");
  }

 private:
  using Features = stereo_descriptor_vo::StereoFeatures;
  using Odometry = nav_msgs::Odometry;
  using Info = stereo_descriptor_vo::VoInfo;
  using Synchroniser = TriggerSynchroniser<Features, Odometry, Info>;

  std::unique_ptr<Synchroniser> makeSynchroniser() {
    const auto onPair = [this](const Features::ConstPtr& features, const Odometry::ConstPtr& odometry,
                               const Info::ConstPtr& info) {
      callback_({features, odometry, info, resumes_});
      unused_.noteUsed();
    };
    const auto onUnpaired = [this](const Features::ConstPtr&, const Odometry::ConstPtr& odometry,
                                   const Info::ConstPtr& info) {
      const bool has_odometry = info && info->state != "LOST" && info->state != "WAITING";
      if (odometry || has_odometry) unused_.add(UnusedInput::kUnpaired);
    };
    constexpr double kEqual = 0.0;  // s: all three have the stamp of the left image
    return std::make_unique<Synchroniser>(queue_size_, kEqual, onPair, onUnpaired);
  }

  template <int input, class Message>
  ros::Subscriber subscribe(const std::string& topic) {
    const auto take = [this, topic](const boost::shared_ptr<const Message>& message) {
      try {
        if (!subscriptions_.isPaused()) synchroniser_->template add<input>(message);
      } catch (const std::exception& e) {
        unused_.add(UnusedInput::kRefused);
        refuse_(nh_.resolveName(topic), message->header.stamp, e.what());
      }
    };
    return nh_.subscribe<Message>(topic, static_cast<std::uint32_t>(queue_size_), take, ros::VoidConstPtr(),
                                  ros::TransportHints().tcpNoDelay());
  }

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
