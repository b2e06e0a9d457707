#pragma once

#include <image_transport/subscriber_plugin.h>
#include <message_filters/simple_filter.h>
#include <sensor_msgs/Image.h>

#include <cstdint>
#include <memory>
#include <pluginlib/class_loader.hpp>
#include <string>
#include <utility>

namespace sdvo {

/// The transports of a stereo pair's images, as the private parameter `image_transport` names them. To be made in
/// onInit(): image_transport's own subscribers load their plugin whenever they subscribe, which in a nodelet's thread
/// races with the manager's loading of other nodelets and at times crashed it.
class StereoImageTransport {
 public:
  using Plugin = image_transport::SubscriberPlugin;

  /// Throws pluginlib::PluginlibException when there is no such transport.
  explicit StereoImageTransport(const ros::NodeHandle& private_nh)
      : hints_("raw", ros::TransportHints(), private_nh),
        loader_("image_transport", "image_transport::SubscriberPlugin"),
        left_(loader_.createUniqueInstance(Plugin::getLookupName(hints_.getTransport()))),
        right_(loader_.createUniqueInstance(Plugin::getLookupName(hints_.getTransport()))) {}

  Plugin& left() { return *left_; }
  Plugin& right() { return *right_; }
  const image_transport::TransportHints& hints() const { return hints_; }

 private:
  image_transport::TransportHints hints_;
  pluginlib::ClassLoader<Plugin> loader_;  // outlives what it made
  pluginlib::UniquePtr<Plugin> left_, right_;
};

/// A message filter's source of images over a plugin that is there already; unsubscribes when destroyed.
class ImageSubscriber : public message_filters::SimpleFilter<sensor_msgs::Image> {
 public:
  ImageSubscriber() = default;
  ImageSubscriber(const ImageSubscriber&) = delete;
  ImageSubscriber& operator=(const ImageSubscriber&) = delete;
  ~ImageSubscriber() {
    if (plugin_) plugin_->shutdown();
  }

  /// `plugin` must outlive this subscriber and serve no other one meanwhile.
  void subscribe(ros::NodeHandle& nh, const std::string& topic, std::uint32_t queue_size,
                 image_transport::SubscriberPlugin& plugin, const image_transport::TransportHints& hints) {
    plugin_ = &plugin;
    const auto pass = [this](const sensor_msgs::ImageConstPtr& image) { signalMessage(image); };
    plugin.subscribe(nh, topic, queue_size, pass, ros::VoidPtr(), hints);
  }

 private:
  image_transport::SubscriberPlugin* plugin_ = nullptr;
};

}  // namespace sdvo
