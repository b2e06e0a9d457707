#include <image_transport/image_transport.h>
#include <sensor_msgs/fill_image.h>
#include <sensor_msgs/image_encodings.h>
#include <stereo_descriptor_vo/FeatureFlow.h>
#include <stereo_descriptor_vo/StereoFeatures.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <atomic>
#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "../../messages/image_conversions.hpp"
#include "../publishers/features_image.hpp"
#include "../synchronisation/camera_finder.hpp"
#include "../synchronisation/image_subscriber.hpp"
#include "../synchronisation/synchronisers.hpp"
#include "robot_nodelet.hpp"

namespace sdvo {

/// Draws the features and their flow over the images, for people. Everything is subscribed only while somebody looks.
class FeaturesImageNodelet : public RobotNodelet {
 public:
  ~FeaturesImageNodelet() override { stopThreads(); }

 private:
  using Image = sensor_msgs::Image;
  using Features = stereo_descriptor_vo::StereoFeatures;
  using Flow = stereo_descriptor_vo::FeatureFlow;
  using Info = stereo_descriptor_vo::VoInfo;
  using Synchroniser = TriggerSynchroniser<Image, Image, Features, Flow, Info>;

  struct Inputs {
    /// The callback of an input of the synchroniser.
    template <int input>
    auto take(FeaturesImageNodelet& nodelet) {
      return [this, &nodelet](const auto& message) { nodelet.take<input>(synchroniser, message); };
    }

    explicit Inputs(FeaturesImageNodelet& nodelet)
        : synchroniser(kQueue, kTolerance, [&nodelet](const auto&... messages) { nodelet.draw(messages...); }) {
      ros::NodeHandle &nh = nodelet.nh_, image_nh = nodelet.finder_->handle(nh);
      StereoImageTransport& transport = *nodelet.transport_;
      // Topics are resolved here, because a transport appends its name to them.
      left.subscribe(image_nh, image_nh.resolveName("left/image_rect"), kQueue, transport.left, take<0>(nodelet));
      right.subscribe(image_nh, image_nh.resolveName("right/image_rect"), kQueue, transport.right, take<1>(nodelet));
      features = nh.subscribe<Features>("stereo_features", kQueue, take<2>(nodelet));
      flow = nh.subscribe<Flow>("feature_flow", kQueue, take<3>(nodelet));
      info = nh.subscribe<Info>("vo_info", kQueue, take<4>(nodelet));
    }

    static constexpr int kQueue = 10;
    static constexpr double kTolerance = 0.025;  // s, of the right images: as max_interval
    Synchroniser synchroniser;
    ImageSubscriber left, right;
    ros::Subscriber features, flow, info;
  };

  void begin() override {
    ros::NodeHandle master_nh = addThread().serve(getNodeHandle());  // what may wait for the master
    nh_ = addThread().serve(getNodeHandle());
    finds_camera_ = getPrivateNodeHandle().param("find_camera",
                                                 nh_.param("stereo_features/find_camera", nh_.getNamespace() != "/"));
    finder_ = std::make_unique<CameraFinder>(nh_.getNamespace(), nh_.resolveName("left/image_rect"),
                                             nh_.resolveName("right/image_rect"));
    transport_ = std::make_unique<StereoImageTransport>(getPrivateNodeHandle());
    const image_transport::SubscriberStatusCallback on_connect =
        [this](const image_transport::SingleSubscriberPublisher&) { updateInputs(); };
    publisher_ = image_transport::ImageTransport(master_nh).advertise("features_image", 1, on_connect, on_connect);
    camera_timer_ =
        master_nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { followCamera(); });
  }

  // In the thread that may wait for the master.

  /// Subscribes to the camera that the image side chose, too.
  void followCamera() {
    ros::master::V_TopicInfo topics;
    std::string ignored;
    const bool searches = inputs_ && finds_camera_ && finder_->isSearching(has_pictures_);
    if (!searches || !ros::master::getTopics(topics) || !finder_->update(topics, ignored)) return;
    inputs_.reset();
    updateInputs();
  }

  void updateInputs() try {
    if (publisher_.getNumSubscribers() == 0) {
      inputs_.reset();
    } else if (!inputs_) {
      inputs_ = std::make_unique<Inputs>(*this);
    }
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM(
        "features_image: cannot subscribe to images, stereo_features, feature_flow and vo_info: " << e.what());
  }

  // In the thread of the images.

  template <int input, class Message>
  void take(Synchroniser& synchroniser, const boost::shared_ptr<const Message>& message) try {
    synchroniser.add<input>(message);
  } catch (const std::exception& e) {
    SDVO_WARN(e.what(), "features_image: a message of type " << ros::message_traits::datatype<Message>()
                                                             << " is not used: " << e.what());
  }

  void draw(const sensor_msgs::ImageConstPtr& left, const sensor_msgs::ImageConstPtr& right,
            const Features::ConstPtr& features, const Flow::ConstPtr& flow, const Info::ConstPtr& info) try {
    grey_.add(*left, *right);
    const cv::Mat drawn = drawFeatures(ros_conversions::toGrey(left, grey_.range()),
                                       ros_conversions::toGrey(right, grey_.range()), *features, *flow, info->state);
    const auto picture = boost::make_shared<sensor_msgs::Image>();
    picture->header = left->header;
    sensor_msgs::fillImage(*picture, sensor_msgs::image_encodings::BGR8, static_cast<std::uint32_t>(drawn.rows),
                           static_cast<std::uint32_t>(drawn.cols), static_cast<std::uint32_t>(drawn.step), drawn.data);
    publisher_.publish(sensor_msgs::ImageConstPtr(picture));
    has_pictures_ = true;
  } catch (const std::exception& e) {
    SDVO_ERROR(e.what(), "features_image at " << left->header.stamp << " skipped: " << e.what());
  }

  ros::NodeHandle nh_;
  bool finds_camera_ = true;
  std::atomic<bool> has_pictures_{false};
  std::unique_ptr<StereoImageTransport> transport_;
  image_transport::Publisher publisher_;
  ros::WallTimer camera_timer_;
  ros_conversions::GreyRangeTracker grey_;
  std::unique_ptr<CameraFinder> finder_;
  std::unique_ptr<Inputs> inputs_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::FeaturesImageNodelet, nodelet::Nodelet)
