#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceInfo.h>

#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "../../config/interface_options.hpp"
#include "../../messages/place_conversions.hpp"
#include "../../places/eased_transform.hpp"
#include "../transforms/transforms.hpp"

namespace sdvo {

/// TF map -> odom, map_pose, place_info, place_signature, and the map: map_path, loops and map_graph.
class PlacePublisher {
 public:
  struct Map {
    ros_conversions::MapState state;
    std::optional<Eigen::Isometry3d> T_base_camera;  ///< none before the first pair
  };
  /// `tag`: of TransformPublisher. `map` returns the current map; a timer calls it.
  PlacePublisher(ros::NodeHandle& nh, const PlaceOutputOptions& options, const std::string& robot, std::uint32_t tag,
                 std::function<Map()> map);

  void publish(const stereo_descriptor_vo::PlaceInfo& info) { info_publisher_.publish(info); }
  void publish(const stereo_descriptor_vo::PlaceSignature& signature) { signature_publisher_.publish(signature); }
  void publish(const stereo_descriptor_vo::PlaceMatch& match) { match_publisher_.publish(match); }
  void publish(const geometry_msgs::PoseWithCovarianceStamped& pose) { pose_publisher_.publish(pose); }

  /// Has the map published soon, if somebody listens.
  void noteChange();

  /// Sets T_map_odom. TF moves there smoothly, except the first time and if `at_once`.
  void correct(const Eigen::Isometry3d& T_map_odom, const std::string& odom_frame, bool at_once);
  /// T_map_odom is unknown.
  void forget();

 private:
  void publishTransform();
  void publishMap();

  const PlaceOutputOptions options_;
  const std::string robot_, map_frame_;
  const std::function<Map()> map_;
  ros::Publisher info_publisher_, signature_publisher_, match_publisher_, pose_publisher_, path_publisher_,
      loops_publisher_, graph_publisher_;
  TransformPublisher transform_publisher_;

  std::mutex mutex_;
  bool changed_ = false;
  std::string odom_frame_;
  Eigen::Isometry3d T_map_odom_;  ///< where eased_ goes
  std::optional<EasedTransform> eased_;
  ros::Time last_stamp_;

  ros::Timer tf_timer_;
  ros::WallTimer map_timer_;
};

}  // namespace sdvo
