#pragma once

#include <image_transport/subscriber_plugin.h>
#include <sensor_msgs/Image.h>

#include <cstdint>
#include <memory>
#include <pluginlib/class_loader.hpp>
#include <string>

namespace sdvo {

/// The image transport of one camera. Its hints name the parameter namespace where the transport has its options.
struct ImageTransport {
  using Plugin = image_transport::SubscriberPlugin;

  image_transport::TransportHints hints;
  pluginlib::UniquePtr<Plugin> plugin;
};

/// The transports of left and right images, named by the private parameter `image_transport`. Make it while the nodelet
/// starts: image_transport's own subscribers load their plugin whenever they subscribe. That races with the manager's
/// loading of other nodelets and has crashed it.
class StereoImageTransport {
 public:
  /// Throws pluginlib::PluginlibException if the transport is not installed.
  explicit StereoImageTransport(const ros::NodeHandle& private_nh)
      : loader_("image_transport", "image_transport::SubscriberPlugin"),
        left(make(private_nh, "left_image")),
        right(make(private_nh, "right_image")) {}

 private:
  ImageTransport make(const ros::NodeHandle& private_nh, const std::string& side) {
    image_transport::TransportHints hints(private_nh.param<std::string>("image_transport", "raw"),
                                          ros::TransportHints().tcpNoDelay(), ros::NodeHandle(private_nh, side));
    return {hints, loader_.createUniqueInstance(ImageTransport::Plugin::getLookupName(hints.getTransport()))};
  }

  pluginlib::ClassLoader<ImageTransport::Plugin> loader_;  // outlives what it made

 public:
  ImageTransport left, right;
};

/// A subscription to images over a plugin that is loaded already. Ends with its destruction.
class ImageSubscriber {
 public:
  ImageSubscriber() = default;
  ImageSubscriber(const ImageSubscriber&) = delete;
  ImageSubscriber& operator=(const ImageSubscriber&) = delete;
  ~ImageSubscriber() {
    if (plugin_) plugin_->shutdown();
  }

  /// `transport` must outlive this subscriber and serve no other one meanwhile.
  void subscribe(ros::NodeHandle& nh, const std::string& topic, std::uint32_t queue_size, ImageTransport& transport,
                 const boost::function<void(const sensor_msgs::ImageConstPtr&)>& callback) {
    plugin_ = transport.plugin.get();
    plugin_->subscribe(nh, topic, queue_size, callback, ros::VoidPtr(), transport.hints);
  }

  /// The name with the transport's ending, such as /compressed.
  std::string topic() const { return plugin_->getTopic(); }

 private:
  image_transport::SubscriberPlugin* plugin_ = nullptr;
};

}  // namespace sdvo
