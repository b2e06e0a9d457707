#include "stereo_input.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "../../messages/stamps.hpp"

namespace sdvo {
namespace {

/// Queue of the subscribers (messages). Callbacks only store messages, so that none is lost in it.
constexpr int kArrivalQueue = 20;

ArrivalLog::Topics resolvedTopics(const ros::NodeHandle& nh) {
  return {nh.resolveName("left/image_rect"), nh.resolveName("right/image_rect"), nh.resolveName("left/camera_info"),
          nh.resolveName("right/camera_info")};
}

double steadyTime() {
  return ros::SteadyTime::now().toSec();
}

}  // namespace

StereoInput::StereoInput(ros::NodeHandle nh, StereoImageTransport& transport, const StereoInputOptions& options,
                         ArrivalLog& arrivals, Callback callback, Refusal refuse)
    : callback_(std::move(callback)),
      refuse_(std::move(refuse)),
      topics_(resolvedTopics(nh)),
      arrivals_(arrivals),
      exact_(options.sync_queue_size, options.pairing.sync_tolerance,
             [this](const auto&... messages) { onPair(messages...); }) {
  if (options.pairing.approximate_sync)
    approximate_ = std::make_unique<ApproximateSynchroniser<Image, Image, Info, Info>>(
        options.sync_queue_size, options.pairing.max_interval, [this](const auto&... messages) { onPair(messages...); });
  arrivals_.begin(topics_, steadyTime());
  const auto queue = static_cast<std::uint32_t>(std::max({kArrivalQueue, options.sync_queue_size, options.queue_size}));
  ros::NodeHandle right_nh = right_callbacks_.serve(nh);
  left_image_.subscribe(nh, topics_[ArrivalLog::kLeftImage], queue, transport.left,
                        [this](const Image::ConstPtr& m) { take<ArrivalLog::kLeftImage>(m); });
  right_image_.subscribe(right_nh, topics_[ArrivalLog::kRightImage], queue, transport.right,
                         [this](const Image::ConstPtr& m) { take<ArrivalLog::kRightImage>(m); });
  left_info_ = nh.subscribe<Info>(topics_[ArrivalLog::kLeftInfo], queue,
                                  [this](const Info::ConstPtr& m) { take<ArrivalLog::kLeftInfo>(m); });
  right_info_ = nh.subscribe<Info>(topics_[ArrivalLog::kRightInfo], queue,
                                   [this](const Info::ConstPtr& m) { take<ArrivalLog::kRightInfo>(m); });
  right_callbacks_.start();
}

std::vector<std::string> StereoInput::subscribedTopics() const {
  return {left_image_.topic(), right_image_.topic(), left_info_.getTopic(), right_info_.getTopic()};
}

template <ArrivalLog::Input input, class Message>
void StereoInput::take(const boost::shared_ptr<const Message>& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    const ros::Time& stamp = message->header.stamp;
    arrivals_.note(input, nanoseconds(stamp), steadyTime());
    const std::string problem = whyUnusable(stamp);
    if (!problem.empty()) return refuse_(input, topics_[input], problem);
    if (approximate_) {
      approximate_->add<input>(message);
    } else {
      exact_.add<input>(message);
    }
  } catch (const std::exception& e) {
    refuse_(input, topics_[input], e.what());
  }
}

void StereoInput::onPair(const sensor_msgs::ImageConstPtr& left_image, const sensor_msgs::ImageConstPtr& right_image,
                         const sensor_msgs::CameraInfoConstPtr& left_info,
                         const sensor_msgs::CameraInfoConstPtr& right_info) {
  arrivals_.notePair(nanoseconds(left_image->header.stamp), nanoseconds(right_image->header.stamp), steadyTime());
  callback_({left_image, right_image, left_info, right_info});
}

}  // namespace sdvo
