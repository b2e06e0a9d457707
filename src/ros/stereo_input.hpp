#pragma once

#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <ros/node_handle.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "../config/nodelet_options.hpp"
#include "image_subscriber.hpp"

namespace sdvo {

/// A rectified pair with its calibration, stamps equal or within the interval allowed.
struct StereoPairMessages {
  sensor_msgs::ImageConstPtr left_image, right_image;
  sensor_msgs::CameraInfoConstPtr left_info, right_info;
};

/// The four synchronised inputs of stereo processing under their usual names: left|right/image_rect and camera_info.
/// Subscribed from construction to destruction. Counts what arrives on each, to tell why no pair comes together.
class StereoInput {
 public:
  using Callback = std::function<void(const StereoPairMessages&)>;

  /// `transport` must outlive the input.
  StereoInput(ros::NodeHandle& nh, StereoImageTransport& transport, const StereoInputOptions& options,
              Callback callback);

  /// When no pair came together since the last call: what arrived on each topic and how far apart the stamps were.
  /// Empty when pairs come.
  std::string explainSilence();

 private:
  using Image = sensor_msgs::Image;
  using Info = sensor_msgs::CameraInfo;
  using ExactPolicy = message_filters::sync_policies::ExactTime<Image, Image, Info, Info>;
  using ApproximatePolicy = message_filters::sync_policies::ApproximateTime<Image, Image, Info, Info>;

  static constexpr int kInputs = 4;

  void onMessage(int input, const ros::Time& stamp);

  template <class MessagePtr>
  boost::function<void(const MessagePtr&)> counter(int input) {
    return [this, input](const MessagePtr& message) { onMessage(input, message->header.stamp); };
  }

  void onPair(const sensor_msgs::ImageConstPtr& left_image, const sensor_msgs::ImageConstPtr& right_image,
              const sensor_msgs::CameraInfoConstPtr& left_info, const sensor_msgs::CameraInfoConstPtr& right_info);

  Callback callback_;
  std::mutex mutex_;
  struct Arrivals {
    std::string topic;
    int count = 0;
    ros::Time last_stamp;
  } arrivals_[kInputs];
  int pairs_ = 0;
  double smallest_gap_ = 0.0;  ///< s, between the newest left and right image

  // Destroyed in reverse order: the synchronisers let go of the subscribers first.
  ImageSubscriber left_image_, right_image_;
  message_filters::Subscriber<Info> left_info_, right_info_;
  std::unique_ptr<message_filters::Synchronizer<ExactPolicy>> exact_;
  std::unique_ptr<message_filters::Synchronizer<ApproximatePolicy>> approximate_;
};

}  // namespace sdvo
