#include <image_transport/image_transport.h>
#include <message_filters/subscriber.h>
#include <message_filters/time_synchronizer.h>
#include <nodelet/nodelet.h>
#include <sensor_msgs/fill_image.h>
#include <sensor_msgs/image_encodings.h>
#include <stereo_descriptor_vo/FeatureFlow.h>
#include <stereo_descriptor_vo/StereoFeatures.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <pluginlib/class_list_macros.hpp>

#include "callback_thread.hpp"
#include "conversions.hpp"
#include "features_image.hpp"
#include "image_subscriber.hpp"
#include "report_throttle.hpp"

namespace sdvo {

/// Draws the features and their flow over the images, for people. Everything is subscribed only while somebody looks.
class FeaturesImageNodelet : public nodelet::Nodelet {
 public:
  ~FeaturesImageNodelet() override { callbacks_.stop(); }

 private:
  using Image = sensor_msgs::Image;
  using Features = stereo_descriptor_vo::StereoFeatures;
  using Flow = stereo_descriptor_vo::FeatureFlow;

  struct Inputs {
    Inputs(ros::NodeHandle& nh, StereoImageTransport& transport) : sync(kQueue) {
      sync.connectInput(left, right, features, flow);
      left.subscribe(nh, "left/image_rect", kQueue, transport.left(), transport.hints());
      right.subscribe(nh, "right/image_rect", kQueue, transport.right(), transport.hints());
      features.subscribe(nh, "stereo_features", kQueue);
      flow.subscribe(nh, "feature_flow", kQueue);
    }

    static constexpr int kQueue = 10;
    ImageSubscriber left, right;
    message_filters::Subscriber<Features> features;
    message_filters::Subscriber<Flow> flow;
    message_filters::TimeSynchronizer<Image, Image, Features, Flow> sync;
  };

  void onInit() override try {
    nh_ = callbacks_.serve(getNodeHandle());
    transport_ = std::make_unique<StereoImageTransport>(getPrivateNodeHandle());
    const image_transport::SubscriberStatusCallback on_connect =
        [this](const image_transport::SingleSubscriberPublisher&) { updateInputs(); };
    const std::lock_guard<std::mutex> lock(connect_mutex_);
    publisher_ = image_transport::ImageTransport(nh_).advertise("features_image", 1, on_connect, on_connect);
    callbacks_.start();
  } catch (const std::exception& e) {
    NODELET_FATAL_STREAM("not started: " << e.what());
    throw;  // the manager forgets the nodelet, and its loader ends with an error
  }

  void updateInputs() try {
    const std::lock_guard<std::mutex> lock(connect_mutex_);
    if (publisher_.getNumSubscribers() == 0) {
      inputs_.reset();
    } else if (!inputs_) {
      inputs_ = std::make_unique<Inputs>(nh_, *transport_);
      inputs_->sync.registerCallback(&FeaturesImageNodelet::draw, this);
    }
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM("cannot subscribe to what is to be drawn: " << e.what());
  }

  void draw(const sensor_msgs::ImageConstPtr& left, const sensor_msgs::ImageConstPtr& right,
            const Features::ConstPtr& features, const Flow::ConstPtr& flow) try {
    const int depth = std::max(ros_conversions::bitDepth(*left), ros_conversions::bitDepth(*right));
    const cv::Mat drawn =
        drawFeatures(ros_conversions::toGrey(left, depth), ros_conversions::toGrey(right, depth), *features, *flow);
    const auto picture = boost::make_shared<sensor_msgs::Image>();
    picture->header = left->header;
    sensor_msgs::fillImage(*picture, sensor_msgs::image_encodings::BGR8, static_cast<std::uint32_t>(drawn.rows),
                           static_cast<std::uint32_t>(drawn.cols), static_cast<std::uint32_t>(drawn.step), drawn.data);
    publisher_.publish(sensor_msgs::ImageConstPtr(picture));
  } catch (const std::exception& e) {
    if (throttle_.allows(e.what()))
      NODELET_ERROR_STREAM("features_image at " << left->header.stamp << " skipped: " << e.what());
  }

  CallbackThread callbacks_;
  ros::NodeHandle nh_;
  ReportThrottle throttle_;
  std::unique_ptr<StereoImageTransport> transport_;
  image_transport::Publisher publisher_;
  std::mutex connect_mutex_;
  std::unique_ptr<Inputs> inputs_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::FeaturesImageNodelet, nodelet::Nodelet)
