#pragma once

#include <ros/time.h>
#include <rosbag/message_instance.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "../ros/arrival_log.hpp"
#include "../ros/stereo_input.hpp"
#include "../ros/synchronisers.hpp"
#include "pair_reader.hpp"
#include "recording.hpp"
#include "stereo_messages.hpp"

namespace sdvo {

/// Four messages of one trigger.
struct ArrivedPair {
  StereoPairMessages messages;
  std::int64_t stamp;                                                    ///< of the left image, ns
  ros::Time complete;                                                    ///< when the last one came
  std::array<std::shared_ptr<const rosbag::MessageInstance>, 2> images;  ///< where a bag has them; null: live
};

/// Takes the messages of a stereo camera, from a bag or from topics. Makes pairs of them, checks their stamps, and
/// finds the camera's pose on TF. For one thread.
class CameraInput {
 public:
  using Use = std::function<void(const ArrivedPair&)>;

  /// `infos`: used with each image in place of camera_info messages.
  CameraInput(const StereoTopics& topics, std::optional<StereoInfos> infos, Use use);

  void add(const StereoMessage& message);
  void add(const tf2_msgs::TFMessage& message, bool is_static);
  /// Of one of the topics, or of TF.
  void add(const rosbag::MessageInstance& instance);

  /// Missing transforms are a fault, except in a recording without any. An empty `base_frame` stands for the frame
  /// above the camera on TF that is the child frame of an odometry in the bag, else for base_link.
  ArrivalFindings findings(const std::string& base_frame, bool is_recorded);

  /// Number of stamps without a pair, with those that still wait; reason of the last unusable one.
  int unused() const { return unusable_ + given_up_ + static_cast<int>(pairs_.waiting()); }
  const std::string& problem() const { return problem_; }

 private:
  using Message = StereoMessage;

  std::string baseAbove(std::string frame) const;

  const StereoTopics topics_;
  const std::optional<StereoInfos> infos_;
  UnusedInput unused_{"messages", 1.0};
  ArrivalLog arrivals_{StereoInputOptions(), unused_, std::numeric_limits<double>::infinity()};
  ros::Time newest_;  ///< arrival
  int unusable_ = 0, given_up_ = 0;
  std::string problem_ = "no four stamps agree", tf_problem_;
  TriggerSynchroniser<Message, Message, Message, Message> pairs_;
  tf2::BufferCore transforms_;
  bool has_transforms_ = false;
  std::optional<std::string> frame_;  ///< of the left images
  std::set<std::string> bases_;       ///< child frames of odometries
};

}  // namespace sdvo
