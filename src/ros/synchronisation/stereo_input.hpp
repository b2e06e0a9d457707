#pragma once

#include <ros/node_handle.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "../../check/arrival_log.hpp"
#include "../../config/interface_options.hpp"
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
              ArrivalLog& arrivals, Callback callback, Refusal refuse);

  /// Names of the topics; images with their transport's ending.
  std::vector<std::string> subscribedTopics() const;

 private:
  using Image = sensor_msgs::Image;
  using Info = sensor_msgs::CameraInfo;

  template <ArrivalLog::Input input, class Message>
  void take(const boost::shared_ptr<const Message>& message);
  void onPair(const sensor_msgs::ImageConstPtr& left_image, const sensor_msgs::ImageConstPtr& right_image,
              const sensor_msgs::CameraInfoConstPtr& left_info, const sensor_msgs::CameraInfoConstPtr& right_info);

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
