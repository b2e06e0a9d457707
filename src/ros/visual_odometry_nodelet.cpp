#include <diagnostic_updater/diagnostic_updater.h>
#include <nodelet/nodelet.h>
#include <std_srvs/Empty.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>

#include "../config/nodelet_options.hpp"
#include "conversions.hpp"
#include "odometry_publisher.hpp"
#include "params.hpp"
#include "reconfigure_server.hpp"
#include "report_throttle.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"
#include "worker.hpp"

namespace sdvo {

/// Stereo feature messages in; odometry, TF and the state of both out. Never sees an image.
class VisualOdometryNodelet : public nodelet::Nodelet {
 public:
  ~VisualOdometryNodelet() override {
    subscriber_.shutdown();
    worker_.reset();
  }

 private:
  using FeaturesMessage = stereo_descriptor_vo::StereoFeatures;
  using FeaturesMessagePtr = stereo_descriptor_vo::StereoFeaturesConstPtr;

  struct Options {
    OdometryOutputOptions output;
    VisualOdometryOptions odometry;

    void describe(OptionList& list) {
      output.describe(list);
      odometry.describe(list);
    }
  };

  void onInit() override try {
    ros::NodeHandle& nh = getNodeHandle();
    ros::NodeHandle& private_nh = getPrivateNodeHandle();
    for (const std::string& name : loadParams(private_nh, options_))
      NODELET_WARN_STREAM("parameter " << name << " is unknown and has no effect");
    odometry_ = std::make_unique<VisualOdometry>(options_.odometry);
    publisher_ = std::make_unique<OdometryPublisher>(nh, options_.output);
    tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_);

    diagnostics_ = std::make_unique<diagnostic_updater::Updater>(nh, private_nh, getName());
    diagnostics_->setHardwareID("none");
    diagnostics_->add("odometry", this, &VisualOdometryNodelet::diagnose);
    diagnostics_timer_ =
        nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { diagnostics_->update(); });
    reset_service_ = private_nh.advertiseService("reset", &VisualOdometryNodelet::onReset, this);

    reconfigured_ = options_.odometry;
    reconfigure_server_ =
        std::make_unique<ReconfigureServer>(private_nh, listOptions(reconfigured_), [this] { onReconfigure(); });

    worker_ = std::make_unique<Worker<FeaturesMessagePtr>>(static_cast<std::size_t>(options_.output.queue_size),
                                                           [this](const FeaturesMessagePtr& m) { process(m); });
    subscriber_ =
        nh.subscribe<FeaturesMessage>("stereo_features", static_cast<std::uint32_t>(options_.output.queue_size),
                                      [this](const FeaturesMessagePtr& m) { worker_->push(m); });
  } catch (const std::exception& e) {
    NODELET_FATAL_STREAM("not started: " << e.what());
  }

  /// In a ROS callback; the worker takes the new options over before its next message.
  void onReconfigure() {
    const std::lock_guard<std::mutex> lock(pending_mutex_);
    pending_ = reconfigured_;
  }

  void takeOverOptions() {
    std::optional<VisualOdometryOptions> pending;
    {
      const std::lock_guard<std::mutex> lock(pending_mutex_);
      pending.swap(pending_);
    }
    if (pending) odometry_->configure(*pending);
  }

  /// In the worker's thread.
  void process(const FeaturesMessagePtr& message) try {
    takeOverOptions();
    if (reset_requested_.exchange(false)) restart("reset was called");
    if (!findExtrinsic(ros_conversions::cleanFrameId(message->header.frame_id))) return;
    StereoFeatures features;
    try {
      features = ros_conversions::fromMessage(*message);
    } catch (const std::invalid_argument&) {
      ++malformed_;
      throw;
    }
    if (!followsLast(*message)) return;

    const OdometryResult result = odometry_->update(features);
    if (result.state == TrackingState::kLost || result.state == TrackingState::kDegraded)
      if (throttle_.allows(toString(result.state)))
        NODELET_WARN_STREAM(toString(result.state) << " at " << message->header.stamp << ": " << result.reason);
    publisher_->publish(result, *T_base_camera_);
    publisher_->publishPoints(*message);
    publisher_->publishFlow(result, features, message->header);
    stereo_descriptor_vo::VoInfo info = ros_conversions::toInfo(result, *message);
    info.dropped_features = worker_->dropped();
    info.out_of_order = out_of_order_;
    info.malformed = malformed_;
    publisher_->publishInfo(info, message->header.stamp);
    const std::lock_guard<std::mutex> lock(info_mutex_);
    last_info_ = info;
  } catch (const std::exception& e) {
    if (throttle_.allows(e.what()))
      NODELET_ERROR_STREAM("features at " << message->header.stamp << " skipped: " << e.what());
  }

  /// False for a late message. A jump back of the clock is a reset, any other break of the stream a new seed.
  bool followsLast(const FeaturesMessage& message) {
    const ros::Time stamp = message.header.stamp;
    if (last_stamp_ && stamp <= *last_stamp_) {
      if (*last_stamp_ - stamp < ros::Duration(kClockJump)) {
        ++out_of_order_;
        if (throttle_.allows("late"))
          NODELET_WARN_STREAM("features at " << stamp << " are late, dropped (" << out_of_order_ << " so far)");
        return false;
      }
      restart("the clock jumped back");
    } else if (stream_epoch_ && *stream_epoch_ != message.stream_epoch) {
      odometry_->breakStream();
    }
    last_stamp_ = stamp;
    stream_epoch_ = message.stream_epoch;
    return true;
  }

  void restart(const char* why) {
    NODELET_WARN_STREAM(why << ": the odometry starts again from the origin");
    odometry_->reset();
    last_stamp_.reset();
    stream_epoch_.reset();
  }

  /// The camera's place on the robot, read once. Waits a while at first, because static transforms and the first
  /// features arrive together; then each message asks again.
  bool findExtrinsic(const std::string& camera_frame) {
    if (T_base_camera_ && camera_frame == camera_frame_) return true;
    const std::string base_frame = ros_conversions::cleanFrameId(options_.output.base_frame_id);
    const auto give_up =
        ros::WallTime::now() + ros::WallDuration(waited_for_extrinsic_ ? 0.0 : options_.output.tf_timeout);
    waited_for_extrinsic_ = true;
    std::string problem;
    while (!tf_buffer_.canTransform(base_frame, camera_frame, ros::Time(0), &problem)) {
      if (ros::WallTime::now() >= give_up || !ros::ok()) {
        if (throttle_.allows("extrinsic"))
          NODELET_ERROR_STREAM("no transform from camera frame '"
                               << camera_frame << "' to base frame '" << base_frame
                               << "' on TF, no odometry without it: publish it (static) or set base_frame_id. "
                               << problem);
        return false;
      }
      problem.clear();  // tf2 appends
      ros::WallDuration(0.01).sleep();
    }
    T_base_camera_ = tf2::transformToEigen(tf_buffer_.lookupTransform(base_frame, camera_frame, ros::Time(0)));
    camera_frame_ = camera_frame;
    warnIfNotOptical();
    return true;
  }

  /// An optical frame looks along +z; on a robot that is horizontal more often than up or down.
  void warnIfNotOptical() {
    if (T_base_camera_->linear().isIdentity(1e-3))
      NODELET_WARN_STREAM("camera frame '"
                          << camera_frame_
                          << "' has the axes of the base (x forward): an optical frame (z forward, x "
                             "right, REP-103) was expected, the odometry will move along the wrong axes");
  }

  bool onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    reset_requested_ = true;
    return true;
  }

  /// Under the lock of last_info_.
  void addCalibration(diagnostic_updater::DiagnosticStatusWrapper& status) const {
    if (std::isfinite(last_info_->disparity_offset))
      status.addf("calibration",
                  "disparities are off by %.2f +- %.2f px in the centre, another %.2f +- %.2f px at 45 degrees",
                  last_info_->disparity_offset, last_info_->disparity_offset_sigma, last_info_->disparity_bend,
                  last_info_->disparity_bend_sigma);
    if (std::isfinite(last_info_->right_rotation[0]))
      status.addf("right camera rotation [mrad]", "%.2f %.2f %.2f", 1e3 * last_info_->right_rotation[0],
                  1e3 * last_info_->right_rotation[1], 1e3 * last_info_->right_rotation[2]);
  }

  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
    using Level = diagnostic_msgs::DiagnosticStatus;
    const std::lock_guard<std::mutex> lock(info_mutex_);
    if (!last_info_) {
      status.summary(Level::WARN, "no features yet on " + getNodeHandle().resolveName("stereo_features"));
      return;
    }
    const auto level = last_info_->state == "TRACKING" ? Level::OK
                       : last_info_->state == "LOST"   ? Level::ERROR
                                                       : Level::WARN;
    status.summary(level, last_info_->state + (last_info_->reason.empty() ? "" : ": " + last_info_->reason));
    status.add("epoch", last_info_->epoch);
    status.add("features", last_info_->features);
    status.add("matches", last_info_->matches);
    status.add("inliers", last_info_->inliers);
    status.add("rms reprojection error [px]", last_info_->rms_reprojection_error);
    status.add("distance [m]", last_info_->distance);
    addCalibration(status);
    status.add("latency [s]", last_info_->latency);
    status.add("dropped pairs", last_info_->dropped_pairs);
    status.add("dropped feature messages", last_info_->dropped_features);
    status.add("out of order", last_info_->out_of_order);
    status.add("malformed", last_info_->malformed);
  }

  static constexpr double kClockJump = 1.0;  // s; what is late by less was only overtaken

  Options options_;
  VisualOdometryOptions reconfigured_;  // the server's
  std::mutex pending_mutex_;
  std::optional<VisualOdometryOptions> pending_;
  std::unique_ptr<ReconfigureServer> reconfigure_server_;
  ReportThrottle throttle_;
  tf2_ros::Buffer tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  std::unique_ptr<OdometryPublisher> publisher_;
  std::unique_ptr<diagnostic_updater::Updater> diagnostics_;
  ros::WallTimer diagnostics_timer_;
  ros::ServiceServer reset_service_;
  std::atomic<bool> reset_requested_{false};

  // Only the worker's thread touches these.
  std::unique_ptr<VisualOdometry> odometry_;
  std::optional<Eigen::Isometry3d> T_base_camera_;
  std::string camera_frame_;
  bool waited_for_extrinsic_ = false;
  std::optional<ros::Time> last_stamp_;
  std::optional<std::uint32_t> stream_epoch_;
  std::uint64_t out_of_order_ = 0, malformed_ = 0;

  std::mutex info_mutex_;
  std::optional<stereo_descriptor_vo::VoInfo> last_info_;

  std::unique_ptr<Worker<FeaturesMessagePtr>> worker_;
  ros::Subscriber subscriber_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::VisualOdometryNodelet, nodelet::Nodelet)
