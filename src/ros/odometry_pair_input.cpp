#include "odometry_pair_input.hpp"

#include <memory>
#include <stdexcept>
#include <utility>

namespace sdvo {

OdometryPairInput::OdometryPairInput(const ros::NodeHandle& nh, int queue_size, Callback callback, Refusal refuse)
    : nh_(nh), queue_size_(queue_size), callback_(std::move(callback)), refuse_(std::move(refuse)) {
  subscribe();
}

std::string OdometryPairInput::topics() const {
  return nh_.resolveName("stereo_features") + ", " + nh_.resolveName("odom") + " and " + nh_.resolveName("vo_info");
}

bool OdometryPairInput::pause() {
  const bool was_subscribed = !subscribers_.empty();
  subscribers_.clear();
  return was_subscribed;
}

bool OdometryPairInput::resume() {
  if (!subscribers_.empty()) return false;
  ++resumes_;
  subscribe();
  return true;
}

void OdometryPairInput::subscribe() {
  const auto onPair = [this](const Features::ConstPtr& features, const Odometry::ConstPtr& odometry,
                             const Info::ConstPtr& info) {
    callback_({features, odometry, info, resumes_});
  };
  const auto onUnpaired = [this](const Features::ConstPtr&, const Odometry::ConstPtr& odometry,
                                 const Info::ConstPtr& info) {
    const bool has_odometry = !info || (info->state != "LOST" && info->state != "WAITING");
    if (odometry || has_odometry) ++unpaired_;
  };
  constexpr double kEqual = 0.0;  // s: all three have the stamp of the left image
  synchroniser_ = std::make_unique<Synchroniser>(queue_size_, kEqual, onPair, onUnpaired);
  subscribers_ = {subscribe<0, Features>("stereo_features"), subscribe<1, Odometry>("odom"),
                  subscribe<2, Info>("vo_info")};
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
  synchroniser_->add<input>(message);
} catch (const std::exception& e) {
  ++refused_;
  refuse_(nh_.resolveName(topic), message->header.stamp, e.what());
}

}  // namespace sdvo
