#include "stereo_input.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <utility>

#include "stamps.hpp"

namespace sdvo {
namespace {

/// Messages that wait for this node's own thread, which handles each in no time: long enough that none is lost there.
constexpr int kArrivalQueue = 20;
constexpr double kLeastPeriod = 0.01;  // s, of a camera

std::array<std::string, ArrivalLog::kInputs> resolvedTopics(const ros::NodeHandle& nh) {
  return {nh.resolveName("left/image_rect"), nh.resolveName("right/image_rect"), nh.resolveName("left/camera_info"),
          nh.resolveName("right/camera_info")};
}

}  // namespace

StereoInput::StereoInput(ros::NodeHandle& nh, StereoImageTransport& transport, const StereoInputOptions& options,
                         Callback callback, Refusal refuse)
    : callback_(std::move(callback)),
      refuse_(std::move(refuse)),
      options_(options),
      arrivals_(resolvedTopics(nh), options),
      waiting_(static_cast<std::size_t>(options.sync_queue_size)) {
  const auto topics = resolvedTopics(nh);
  connect(left_image_, left_image_gate_, ArrivalLog::kLeftImage, topics[0]);
  connect(right_image_, right_image_gate_, ArrivalLog::kRightImage, topics[1]);
  connect(left_info_, left_info_gate_, ArrivalLog::kLeftInfo, topics[2]);
  connect(right_info_, right_info_gate_, ArrivalLog::kRightInfo, topics[3]);

  synchronise();

  const auto arrivals =
      static_cast<std::uint32_t>(std::max({kArrivalQueue, options.sync_queue_size, options.queue_size}));
  ros::NodeHandle right_nh = right_callbacks_.serve(nh);
  left_image_.subscribe(nh, topics[0], arrivals, transport.left);
  right_image_.subscribe(right_nh, topics[1], arrivals, transport.right);
  left_info_.subscribe(nh, topics[2], arrivals);
  right_info_.subscribe(nh, topics[3], arrivals);
  right_callbacks_.start();
}

/// Anew: what waited is forgotten.
void StereoInput::synchronise() {
  const auto queue = static_cast<std::uint32_t>(options_.sync_queue_size);
  if (options_.approximate_sync) {
    ApproximatePolicy policy(queue);
    policy.setMaxIntervalDuration(ros::Duration(options_.max_interval));
    // Without a least time between images of one camera each pair would wait for the next one, to see that it is no
    // better.
    const ros::Duration least(std::min(options_.max_interval, kLeastPeriod));
    for (int input = 0; input < ArrivalLog::kInputs; ++input) policy.setInterMessageLowerBound(input, least);
    approximate_ = std::make_unique<message_filters::Synchronizer<ApproximatePolicy>>(
        static_cast<const ApproximatePolicy&>(policy), left_image_gate_, right_image_gate_, left_info_gate_,
        right_info_gate_);
    approximate_->registerCallback(&StereoInput::onPair, this);
  } else {
    exact_ = std::make_unique<message_filters::Synchronizer<ExactPolicy>>(
        ExactPolicy(queue), left_image_gate_, right_image_gate_, left_info_gate_, right_info_gate_);
    exact_->registerCallback(&StereoInput::onPair, this);
  }
}

template <class Source, class Message>
void StereoInput::connect(Source& source, Gate<Message>& gate, ArrivalLog::Input input, const std::string& topic) {
  using MessagePtr = boost::shared_ptr<const Message>;
  const boost::function<void(const MessagePtr&)> pass = [this, &gate, input, topic](const MessagePtr& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    try {
      const ros::Time& stamp = message->header.stamp;
      arrivals_.note(input, stamp, ros::SteadyTime::now().toSec());
      const std::string problem = whyUnusable(stamp);
      if (!problem.empty()) return refuse_(topic, problem);
      // The policy of other stamps takes what waits longest in its queue for the oldest, whatever its stamp.
      if (!options_.approximate_sync && waiting_.shutOut(nanoseconds(stamp))) synchronise();
      gate.signalMessage(message);
    } catch (const std::exception& e) {
      refuse_(topic, e.what());
    }
  };
  source.template registerCallback<const MessagePtr&>(pass);
}

void StereoInput::onPair(const sensor_msgs::ImageConstPtr& left_image, const sensor_msgs::ImageConstPtr& right_image,
                         const sensor_msgs::CameraInfoConstPtr& left_info,
                         const sensor_msgs::CameraInfoConstPtr& right_info) {
  arrivals_.notePair();
  waiting_.complete(nanoseconds(left_image->header.stamp));
  callback_({left_image, right_image, left_info, right_info});
}

}  // namespace sdvo
