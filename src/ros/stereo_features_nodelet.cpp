#include <nodelet/nodelet.h>

#include <boost/make_shared.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>

#include "../config/nodelet_options.hpp"
#include "conversions.hpp"
#include "params.hpp"
#include "reconfigure_server.hpp"
#include "report_throttle.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_input.hpp"
#include "worker.hpp"

namespace sdvo {

/// Rectified stereo images in, depth-scaled stereo descriptors out. Images are subscribed only while somebody listens.
class StereoFeaturesNodelet : public nodelet::Nodelet {
 public:
  ~StereoFeaturesNodelet() override {
    const std::lock_guard<std::mutex> lock(connect_mutex_);
    input_.reset();   // nothing may arrive any more …
    worker_.reset();  // … when the worker goes
  }

 private:
  struct Options {
    StereoInputOptions input;
    FeatureExtractorOptions extractor;

    void describe(OptionList& list) {
      input.describe(list);
      extractor.describe(list);
    }
  };

  void onInit() override try {
    ros::NodeHandle& nh = getNodeHandle();
    ros::NodeHandle& private_nh = getPrivateNodeHandle();
    for (const std::string& name : loadParams(private_nh, options_))
      NODELET_WARN_STREAM("parameter " << name << " is unknown and has no effect");
    transport_ = std::make_unique<StereoImageTransport>(private_nh);
    extractor_ = std::make_unique<FeatureExtractor>(options_.extractor);
    worker_ = std::make_unique<Worker<StereoPairMessages>>(static_cast<std::size_t>(options_.input.queue_size),
                                                           [this](const StereoPairMessages& pair) { process(pair); });
    silence_timer_ = nh.createWallTimer(ros::WallDuration(kSilencePeriod), [this](const ros::WallTimerEvent&) {
      const std::lock_guard<std::mutex> lock(connect_mutex_);
      const std::string silence = input_ ? input_->explainSilence() : std::string();
      if (!silence.empty()) NODELET_WARN_STREAM(silence);
    });

    reconfigured_ = options_.extractor;
    reconfigure_server_ =
        std::make_unique<ReconfigureServer>(private_nh, listOptions(reconfigured_), [this] { onReconfigure(); });

    // A subscriber may connect before advertise() returns: the mutex makes it wait until publisher_ is there.
    const ros::SubscriberStatusCallback on_connect = [this](const ros::SingleSubscriberPublisher&) { updateInput(); };
    const std::lock_guard<std::mutex> lock(connect_mutex_);
    publisher_ =
        nh.advertise<stereo_descriptor_vo::StereoFeatures>("stereo_features", kPublishQueue, on_connect, on_connect);
  } catch (const std::exception& e) {
    NODELET_FATAL_STREAM("not started: " << e.what());
  }

  void updateInput() try {
    const std::lock_guard<std::mutex> lock(connect_mutex_);
    if (publisher_.getNumSubscribers() == 0) {
      input_.reset();
    } else if (!input_) {
      input_ = std::make_unique<StereoInput>(getNodeHandle(), *transport_, options_.input,
                                             [this](const StereoPairMessages& pair) { worker_->push(pair); });
    }
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM("cannot subscribe to the images: " << e.what());
  }

  /// In a ROS callback; the worker takes the new options over before its next pair.
  void onReconfigure() {
    const std::lock_guard<std::mutex> lock(pending_mutex_);
    pending_ = reconfigured_;
  }

  void takeOverOptions() {
    std::optional<FeatureExtractorOptions> pending;
    {
      const std::lock_guard<std::mutex> lock(pending_mutex_);
      pending.swap(pending_);
    }
    if (!pending) return;
    extractor_ = std::make_unique<FeatureExtractor>(*pending);
    ++stream_epoch_;  // rows of another kind or size do not continue the old ones
    NODELET_INFO("options reconfigured: a new stream begins");
  }

  /// In the worker's thread.
  void process(const StereoPairMessages& pair) try {
    takeOverOptions();
    const ros::Time stamp = pair.left_image->header.stamp;
    if (!followsLast(stamp)) return;
    const StereoCamera camera = ros_conversions::toStereoCamera(*pair.left_info, *pair.right_info);
    const cv::Mat left = ros_conversions::toGrey(pair.left_image);
    const cv::Mat right = ros_conversions::toGrey(pair.right_image);
    const StereoFeatures features = extractor_->extract(camera, left, right, static_cast<std::int64_t>(stamp.toNSec()));
    // Only now: a calibration that does not fit the images was refused and is no new stream.
    updateCamera(camera);

    const auto message = boost::make_shared<stereo_descriptor_vo::StereoFeatures>(
        ros_conversions::toMessage(features, extractor_->options().size_curve));
    message->header.stamp = stamp;
    message->header.frame_id = ros_conversions::cleanFrameId(pair.left_image->header.frame_id);
    message->stream_epoch = stream_epoch_;
    message->dropped_pairs = worker_->dropped() + late_pairs_;
    publisher_.publish(message);
  } catch (const std::exception& e) {
    if (throttle_.allows(e.what()))
      NODELET_ERROR_STREAM("pair at " << pair.left_image->header.stamp << " of " << pair.left_image->header.frame_id
                                      << " skipped: " << e.what());
  }

  /// False for a late pair, which is dropped and counted; a jump back of the clock starts a new stream.
  bool followsLast(const ros::Time& stamp) {
    if (last_stamp_ && stamp <= *last_stamp_) {
      if (*last_stamp_ - stamp < ros::Duration(kClockJump)) {
        ++late_pairs_;
        if (throttle_.allows("late"))
          NODELET_WARN_STREAM("pair at " << stamp << " is late, dropped (" << late_pairs_ << " so far)");
        return false;
      }
      NODELET_WARN_STREAM("the clock jumped back from " << *last_stamp_ << " to " << stamp << ": a new stream begins");
      ++stream_epoch_;
    }
    last_stamp_ = stamp;
    return true;
  }

  void updateCamera(const StereoCamera& camera) {
    if (camera_ && *camera_ != camera) {
      NODELET_WARN("camera_info changed: a new stream begins");
      ++stream_epoch_;
    }
    camera_ = camera;
  }

  static constexpr double kSilencePeriod = 10.0;  // s between explanations why nothing comes
  static constexpr double kClockJump = 1.0;       // s; what is late by less was only overtaken
  static constexpr int kPublishQueue = 10;

  Options options_;
  FeatureExtractorOptions reconfigured_;  // the server's
  std::mutex pending_mutex_;
  std::optional<FeatureExtractorOptions> pending_;
  std::unique_ptr<ReconfigureServer> reconfigure_server_;
  ReportThrottle throttle_;
  ros::Publisher publisher_;
  ros::WallTimer silence_timer_;

  // Only the worker's thread touches these.
  std::unique_ptr<FeatureExtractor> extractor_;
  std::optional<StereoCamera> camera_;
  std::optional<ros::Time> last_stamp_;
  std::uint32_t stream_epoch_ = 0;
  std::uint64_t late_pairs_ = 0;

  std::mutex connect_mutex_;
  std::unique_ptr<Worker<StereoPairMessages>> worker_;
  std::unique_ptr<StereoImageTransport> transport_;
  std::unique_ptr<StereoInput> input_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::StereoFeaturesNodelet, nodelet::Nodelet)
