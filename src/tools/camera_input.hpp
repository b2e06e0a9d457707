#pragma once

#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <functional>
#include <optional>
#include <string>

#include "../check/stamp_check.hpp"
#include "../ros/arrival_log.hpp"
#include "../ros/pair_decoder.hpp"
#include "../ros/stereo_input.hpp"
#include "../ros/synchronisers.hpp"
#include "recording.hpp"
#include "stereo_messages.hpp"

namespace sdvo {

/// What the messages of a pair hold, decoded.
RecordedPair recordedPair(const DecodedPair& decoded, const StereoPairMessages& messages, std::int64_t stamp);

/// Messages of a stereo camera as they arrive, from a bag or from topics: what their stamps look like, which make a
/// pair, and where TF has the camera. One thread calls it.
class CameraInput {
 public:
  CameraInput(const StereoTopics& topics, std::function<void(const StereoPairMessages&)> use);

  template <ArrivalLog::Input input, class Message>
  void add(const boost::shared_ptr<const Message>& message, const ros::Time& arrival);
  void add(const StereoMessage& message, const ros::Time& arrival);
  void add(const tf2_msgs::TFMessage& message, bool is_static);
  /// All messages of a bag.
  void addAll(const rosbag::Bag& bag, const StereoTopics& topics);

  ArrivalFindings findings(const std::string& base_frame);

 private:
  /// Whether TF has `base_frame` <- the images' frame.
  Finding judge(const std::optional<Eigen::Isometry3d>& T_base_camera, const std::string& base_frame,
                const std::string& problem) const;

  StampCheck stamps_;
  UnusedInput unused_{"messages", 1.0};
  ArrivalLog arrivals_;
  double newest_ = 0.0;  ///< arrival, s
  TriggerSynchroniser<sensor_msgs::Image, sensor_msgs::Image, sensor_msgs::CameraInfo, sensor_msgs::CameraInfo> pairs_;
  tf2::BufferCore transforms_;
  std::optional<std::string> frame_;  ///< of the left images
};

template <ArrivalLog::Input input, class Message>
void CameraInput::add(const boost::shared_ptr<const Message>& message, const ros::Time& arrival) {
  const ros::Time& stamp = message->header.stamp;
  stamps_.note(input, nanoseconds(stamp), arrival.toSec());
  newest_ = arrival.toSec();
  arrivals_.note(input, stamp, newest_);
  if (input == ArrivalLog::kLeftImage) frame_ = message->header.frame_id;
  if (whyUnusable(stamp).empty()) pairs_.template add<input>(message);
}

}  // namespace sdvo
