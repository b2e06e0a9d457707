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

#include "../check/arrival_log.hpp"
#include "../ros/synchronisation/stereo_input.hpp"
#include "../ros/synchronisation/synchronisers.hpp"
#include "pair_reader.hpp"
#include "recording.hpp"
#include "stereo_messages.hpp"

namespace sdvo {

/// Four messages of one trigger.
struct ArrivedPair {
  StereoPairMessages messages;
  std::int64_t stamp;                                                    ///< of the left image, ns
  ros::Time complete;                                                    ///< when the last one came
  double right_delay;                                                    ///< s, by the stamps; 0 for one trigger
  std::array<std::shared_ptr<const rosbag::MessageInstance>, 2> images;  ///< where a bag has them; null: live
};

/// Takes the messages of a stereo camera, from a bag or from topics. Makes pairs of them, checks their stamps, and
/// finds the camera's pose on TF. For one thread.
class CameraInput {
 public:
  using Use = std::function<void(const ArrivedPair&)>;

  /// `infos`: used with each image in place of camera_info messages.
  CameraInput(const StereoTopics& topics, std::optional<StereoInfos> infos, const PairingOptions& pairing, Use use);

  void add(const StereoMessage& message);
  void add(const tf2_msgs::TFMessage& message, bool is_static);
  /// Of one of the topics, or of TF.
  void add(const rosbag::MessageInstance& instance);

  /// Missing transforms are a fault, except in a recording without any. An empty `base_frame` stands for the frame
  /// above the camera on TF that is the child frame of an odometry in the bag, else for base_link.
  ArrivalFindings findings(const std::string& base_frame, bool is_recorded);

  /// T_parent_child on TF; none, with the problem. For any thread.
  std::optional<Eigen::Isometry3d> find(const std::string& parent, const std::string& child, std::string& problem) const;

  /// Of all left images so far.
  const std::set<std::int64_t>& leftStamps() const { return left_stamps_; }

  /// Number of stamps without a pair, with those that still wait.
  int unused() const;
  /// Why there is no pair: what is wrong with the last unusable message, else how the stamps differ.
  std::string problem();

 private:
  using Message = StereoMessage;
  using MessagePtr = boost::shared_ptr<const Message>;

  void onPair(const MessagePtr& left, const MessagePtr& right, const MessagePtr& left_info,
              const MessagePtr& right_info);
  template <int input>
  void pair(const MessagePtr& message);
  std::string baseAbove(const std::string& frame) const;

  const StereoTopics topics_;
  const std::optional<StereoInfos> infos_;
  const Use use_;
  UnusedInput unused_{"messages", 1.0};
  ArrivalLog arrivals_;
  ros::Time newest_;  ///< arrival
  int unusable_ = 0, given_up_ = 0, lefts_ = 0, paired_ = 0;
  std::string problem_, tf_problem_;
  TriggerSynchroniser<Message, Message, Message, Message> exact_;
  std::optional<ApproximateSynchroniser<Message, Message, Message, Message>> approximate_;  ///< in its place
  tf2::BufferCore transforms_;
  bool has_transforms_ = false;
  std::optional<std::string> frame_;  ///< of the left images
  std::set<std::int64_t> left_stamps_;
  std::set<std::string> bases_;       ///< child frames of odometries
};

}  // namespace sdvo
