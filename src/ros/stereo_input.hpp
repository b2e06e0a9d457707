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

#include "../config/interface_options.hpp"
#include "arrival_log.hpp"
#include "callback_thread.hpp"
#include "image_subscriber.hpp"
#include "waiting_stamps.hpp"

namespace sdvo {

/// A rectified pair with its calibration, stamps equal or within the interval allowed.
struct StereoPairMessages {
  sensor_msgs::ImageConstPtr left_image, right_image;
  sensor_msgs::CameraInfoConstPtr left_info, right_info;
};

/// The four synchronised inputs of stereo processing under their usual names: left|right/image_rect and camera_info.
/// Subscribed from construction to destruction. The right images have a thread of their own, so that a transport
/// decodes both sides at once; the callbacks never run at the same time.
class StereoInput {
 public:
  using Callback = std::function<void(const StereoPairMessages&)>;
  /// Of a message that is not used, and why.
  using Refusal = std::function<void(const std::string& topic, const std::string& why)>;

  /// `transport` must outlive the input.
  StereoInput(ros::NodeHandle& nh, StereoImageTransport& transport, const StereoInputOptions& options,
              Callback callback, Refusal refuse);

  /// See ArrivalLog.
  std::string explainSilence() { return arrivals_.explainSilence(); }

 private:
  using Image = sensor_msgs::Image;
  using Info = sensor_msgs::CameraInfo;
  using ExactPolicy = message_filters::sync_policies::ExactTime<Image, Image, Info, Info>;
  using ApproximatePolicy = message_filters::sync_policies::ApproximateTime<Image, Image, Info, Info>;

  /// Lets messages through that the synchroniser can take: it throws at some stamps.
  template <class Message>
  struct Gate : message_filters::SimpleFilter<Message> {
    using message_filters::SimpleFilter<Message>::signalMessage;
  };

  template <class Source, class Message>
  void connect(Source& source, Gate<Message>& gate, ArrivalLog::Input input, const std::string& topic);

  void synchronise();
  void onPair(const sensor_msgs::ImageConstPtr& left_image, const sensor_msgs::ImageConstPtr& right_image,
              const sensor_msgs::CameraInfoConstPtr& left_info, const sensor_msgs::CameraInfoConstPtr& right_info);

  Callback callback_;
  Refusal refuse_;
  const StereoInputOptions options_;
  ArrivalLog arrivals_;
  std::mutex mutex_;  // of what follows
  WaitingStamps waiting_;

  // Destroyed in reverse order: first the subscribers, then the synchronisers, which let go of the gates.
  Gate<Image> left_image_gate_, right_image_gate_;
  Gate<Info> left_info_gate_, right_info_gate_;
  std::unique_ptr<message_filters::Synchronizer<ExactPolicy>> exact_;
  std::unique_ptr<message_filters::Synchronizer<ApproximatePolicy>> approximate_;
  CallbackThread right_callbacks_;
  ImageSubscriber left_image_, right_image_;
  message_filters::Subscriber<Info> left_info_, right_info_;
};

}  // namespace sdvo
