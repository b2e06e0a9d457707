#include <cv_bridge/cv_bridge.h>
#include <message_filters/subscriber.h>
#include <message_filters/time_synchronizer.h>
#include <nodelet/nodelet.h>
#include <sensor_msgs/image_encodings.h>
#include <stereo_descriptor_vo/FeatureFlow.h>
#include <stereo_descriptor_vo/StereoFeatures.h>

#include <memory>
#include <mutex>
#include <pluginlib/class_list_macros.hpp>

#include "conversions.hpp"
#include "features_image.hpp"
#include "report_throttle.hpp"

namespace sdvo {

/// Draws the features and their flow over the images, for people. Everything is subscribed only while somebody looks.
class FeaturesImageNodelet : public nodelet::Nodelet {
 private:
  using Image = sensor_msgs::Image;
  using Features = stereo_descriptor_vo::StereoFeatures;
  using Flow = stereo_descriptor_vo::FeatureFlow;

  struct Inputs {
    explicit Inputs(ros::NodeHandle& nh) : sync(kQueue) {
      sync.connectInput(left, right, features, flow);
      left.subscribe(nh, "left/image_rect", kQueue);
      right.subscribe(nh, "right/image_rect", kQueue);
      features.subscribe(nh, "stereo_features", kQueue);
      flow.subscribe(nh, "feature_flow", kQueue);
    }

    static constexpr int kQueue = 10;
    message_filters::Subscriber<Image> left, right;
    message_filters::Subscriber<Features> features;
    message_filters::Subscriber<Flow> flow;
    message_filters::TimeSynchronizer<Image, Image, Features, Flow> sync;
  };

  void onInit() override {
    const ros::SubscriberStatusCallback on_connect = [this](const ros::SingleSubscriberPublisher&) { updateInputs(); };
    const std::lock_guard<std::mutex> lock(connect_mutex_);
    publisher_ = getNodeHandle().advertise<Image>("features_image", 1, on_connect, on_connect);
  }

  void updateInputs() {
    const std::lock_guard<std::mutex> lock(connect_mutex_);
    if (publisher_.getNumSubscribers() == 0) {
      inputs_.reset();
    } else if (!inputs_) {
      inputs_ = std::make_unique<Inputs>(getNodeHandle());
      inputs_->sync.registerCallback(&FeaturesImageNodelet::draw, this);
    }
  }

  void draw(const sensor_msgs::ImageConstPtr& left, const sensor_msgs::ImageConstPtr& right,
            const Features::ConstPtr& features, const Flow::ConstPtr& flow) try {
    cv_bridge::CvImage picture(left->header, sensor_msgs::image_encodings::BGR8);
    picture.image = drawFeatures(ros_conversions::toGrey(left), ros_conversions::toGrey(right), *features, *flow);
    publisher_.publish(picture.toImageMsg());
  } catch (const std::exception& e) {
    if (throttle_.allows(e.what()))
      NODELET_ERROR_STREAM("features_image at " << left->header.stamp << " skipped: " << e.what());
  }

  ReportThrottle throttle_;
  ros::Publisher publisher_;
  std::mutex connect_mutex_;
  std::unique_ptr<Inputs> inputs_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::FeaturesImageNodelet, nodelet::Nodelet)
