#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <functional>
#include <optional>
#include <string>

#include "../check/stamp_check.hpp"
#include "../ros/arrival_log.hpp"
#include "../ros/stereo_input.hpp"
#include "../ros/synchronisers.hpp"
#include "stereo_messages.hpp"

namespace sdvo {

/// Messages of a stereo camera as they arrive, from a bag or from topics: what their stamps look like, which make a
/// pair, and where TF has the camera. One thread calls it.
class CameraInput {
 public:
  CameraInput(const StereoTopics& topics, std::function<void(const StereoPairMessages&)> use);

  template <ArrivalLog::Input input, class Message>
  void add(const boost::shared_ptr<const Message>& message, const ros::Time& arrival);
  void add(const StereoMessage& message, const ros::Time& arrival);
  void add(const tf2_msgs::TFMessage& message, bool is_static);

  Finding topics();
  Finding stamps() const { return stamps_.stamps(); }
  /// Whether TF has `base_frame` <- the images' frame.
  Finding transform(const std::string& base_frame) const;
  double rate() const { return stamps_.rate(); }

 private:
  StampCheck stamps_;
  ArrivalLog arrivals_;
  TriggerSynchroniser<sensor_msgs::Image, sensor_msgs::Image, sensor_msgs::CameraInfo, sensor_msgs::CameraInfo> pairs_;
  tf2::BufferCore transforms_;
  std::optional<std::string> frame_;  ///< of the left images
};

template <ArrivalLog::Input input, class Message>
void CameraInput::add(const boost::shared_ptr<const Message>& message, const ros::Time& arrival) {
  const ros::Time& stamp = message->header.stamp;
  stamps_.note(input, nanoseconds(stamp), arrival.toSec());
  arrivals_.note(input, stamp, arrival.toSec());
  if (input == ArrivalLog::kLeftImage) frame_ = message->header.frame_id;
  if (whyUnusable(stamp).empty()) pairs_.template add<input>(message);
}

}  // namespace sdvo
