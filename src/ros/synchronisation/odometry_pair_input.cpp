#include "odometry_pair_input.hpp"

#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

namespace sdvo {

OdometryPairInput::OdometryPairInput(const ros::NodeHandle& nh, int queue_size, UnusedInput& unused, Callback callback,
                                     Refusal refuse)
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

std::string OdometryPairInput::topics() const {
  return nh_.resolveName("stereo_features") + ", " + nh_.resolveName("odom") + " and " + nh_.resolveName("vo_info");
}

std::unique_ptr<OdometryPairInput::Synchroniser> OdometryPairInput::makeSynchroniser() {
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
ros::Subscriber OdometryPairInput::subscribe(const std::string& topic) {
  return nh_.subscribe<Message>(
      topic, static_cast<std::uint32_t>(queue_size_),
      [this, topic](const boost::shared_ptr<const Message>& message) { take<input>(topic, message); },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

template <int input, class Message>
void OdometryPairInput::take(const std::string& topic, const boost::shared_ptr<const Message>& message) try {
  if (!subscriptions_.isPaused()) synchroniser_->add<input>(message);
} catch (const std::exception& e) {
  unused_.add(UnusedInput::kRefused);
  refuse_(nh_.resolveName(topic), message->header.stamp, e.what());
}

}  // namespace sdvo
