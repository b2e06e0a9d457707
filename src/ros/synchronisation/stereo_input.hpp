#pragma once

#include <ros/node_handle.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "../../check/arrival_log.hpp"
#include "../../config/interface_options.hpp"
#include "../../messages/stamps.hpp"
#include "../node/threads.hpp"
#include "image_subscriber.hpp"
#include "synchronisers.hpp"

namespace sdvo {

/// A rectified pair with its calibration, stamps equal or within the interval allowed.
struct StereoPairMessages {
  sensor_msgs::ImageConstPtr left_image, right_image;
  sensor_msgs::CameraInfoConstPtr left_info, right_info;
};

/// The four synchronised inputs of stereo processing: left|right/image_rect and left|right/camera_info. Subscribed from
/// construction to destruction. The right images have a thread of their own, so that a transport decodes both sides in
/// parallel; the callbacks never run in parallel.
class StereoInput {
 public:
  using Callback = std::function<void(const StereoPairMessages&)>;
  /// For a message that is not used, with the reason.
  using Refusal = std::function<void(ArrivalLog::Input input, const std::string& topic, const std::string& why)>;

  /// Topics are resolved by `nh`. `transport` and `arrivals` must outlive the input.
  StereoInput(ros::NodeHandle nh, StereoImageTransport& transport, const StereoInputOptions& options,
              ArrivalLog& arrivals, Callback callback, Refusal refuse)
      : callback_(std::move(callback)),
        refuse_(std::move(refuse)),
        topics_{nh.resolveName("left/image_rect"), nh.resolveName("right/image_rect"),
                nh.resolveName("left/camera_info"), nh.resolveName("right/camera_info")},
        arrivals_(arrivals),
        exact_(options.sync_queue_size, options.pairing.sync_tolerance,
               [this](const auto&... messages) { onPair(messages...); }) {
    if (options.pairing.approximate_sync)
      approximate_ = std::make_unique<ApproximateSynchroniser<Image, Image, Info, Info>>(
          options.sync_queue_size, options.pairing.max_interval,
          [this](const auto&... messages) { onPair(messages...); });
    arrivals_.begin(topics_, steadyTime());
    // Callbacks only store messages, so that none is lost in this queue.
    const auto queue = static_cast<std::uint32_t>(std::max({20, options.sync_queue_size, options.queue_size}));
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

  /// Names of the topics; images with their transport's ending.
  std::vector<std::string> subscribedTopics() const {
    return {left_image_.topic(), right_image_.topic(), left_info_.getTopic(), right_info_.getTopic()};
  }

 private:
  using Image = sensor_msgs::Image;
  using Info = sensor_msgs::CameraInfo;

  static double steadyTime() { return ros::SteadyTime::now().toSec(); }

  template <ArrivalLog::Input input, class Message>
  void take(const boost::shared_ptr<const Message>& message) {
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

  void onPair(const sensor_msgs::ImageConstPtr& left_image, const sensor_msgs::ImageConstPtr& right_image,
              const sensor_msgs::CameraInfoConstPtr& left_info, const sensor_msgs::CameraInfoConstPtr& right_info) {
    arrivals_.notePair(nanoseconds(left_image->header.stamp), nanoseconds(right_image->header.stamp), steadyTime());
    callback_({left_image, right_image, left_info, right_info});
  }

  Callback callback_;
  Refusal refuse_;
  const ArrivalLog::Topics topics_;
  ArrivalLog& arrivals_;
  std::mutex mutex_;  // of what follows
  TriggerSynchroniser<Image, Image, Info, Info> exact_;
  std::unique_ptr<ApproximateSynchroniser<Image, Image, Info, Info>> approximate_;  // null without approximate_sync

  // Destroyed in reverse order: first the subscribers.
  CallbackThread right_callbacks_;
  ImageSubscriber left_image_, right_image_;
  ros::Subscriber left_info_, right_info_;
};

}  // namespace sdvo
