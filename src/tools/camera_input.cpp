#include "camera_input.hpp"

#include <rosbag/view.h>
#include <tf2_eigen/tf2_eigen.h>

#include <utility>
#include <vector>

#include "../common/text.hpp"
#include "../messages/camera_conversions.hpp"
#include "../messages/frames.hpp"

namespace sdvo {

RecordedPair recordedPair(const DecodedPair& decoded, const StereoPairMessages& messages, std::int64_t stamp) {
  return {decoded.camera,
          decoded.left,
          decoded.right,
          stamp,
          messages.left_info->distortion_model,
          ros_conversions::whyUnrectified(*messages.left_info, *messages.right_info)};
}

CameraInput::CameraInput(const StereoTopics& topics, std::function<void(const StereoPairMessages&)> use)
    : stamps_(topics),
      arrivals_(StereoInputOptions(), unused_),
      pairs_(StereoInputOptions().sync_queue_size, StereoInputOptions().sync_tolerance,
             [this, use = std::move(use)](
                 const sensor_msgs::ImageConstPtr& left, const sensor_msgs::ImageConstPtr& right,
                 const sensor_msgs::CameraInfoConstPtr& left_info, const sensor_msgs::CameraInfoConstPtr& right_info) {
               stamps_.notePair(nanoseconds(left->header.stamp));
               arrivals_.notePair(left->header.stamp, right->header.stamp, newest_);
               use({left, right, left_info, right_info});
             }) {
  arrivals_.begin(topics, 0.0);  // long ago: a short recording is judged, too
}

void CameraInput::add(const StereoMessage& message, const ros::Time& arrival) {
  switch (message.input) {
    case ArrivalLog::kLeftImage:
      return add<ArrivalLog::kLeftImage>(message.image, arrival);
    case ArrivalLog::kRightImage:
      return add<ArrivalLog::kRightImage>(message.image, arrival);
    case ArrivalLog::kLeftInfo:
      return add<ArrivalLog::kLeftInfo>(message.info, arrival);
    default:
      return add<ArrivalLog::kRightInfo>(message.info, arrival);
  }
}

void CameraInput::add(const tf2_msgs::TFMessage& message, bool is_static) {
  for (const geometry_msgs::TransformStamped& transform : message.transforms)
    if (transform.header.stamp.isZero() || whyUnusable(transform.header.stamp).empty())
      transforms_.setTransform(transform, "check_camera", is_static);
}

void CameraInput::addAll(const rosbag::Bag& bag, const StereoTopics& topics) {
  std::vector<std::string> wanted(topics.begin(), topics.end());
  wanted.insert(wanted.end(), {"/tf", "/tf_static"});
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(wanted)))
    if (const auto transforms = instance.instantiate<tf2_msgs::TFMessage>())
      add(*transforms, instance.getTopic() == "/tf_static");
    else
      add(readStereoMessage(instance, topics), instance.getTime());
}

ArrivalFindings CameraInput::findings(const std::string& base_frame) {
  const RateOptions rates;
  std::optional<Eigen::Isometry3d> T_base_camera;
  std::string problem;
  try {
    const std::string camera = ros_conversions::cleanFrameId(frame_.value_or(""));
    T_base_camera = tf2::transformToEigen(transforms_.lookupTransform(base_frame, camera, ros::Time(0)));
  } catch (const tf2::TransformException& e) {
    problem = e.what();
  }
  return {stamps_.topics(rates.min_rate, rates.max_rate, arrivals_.explainSilence(newest_)), stamps_.stamps(),
          judge(T_base_camera, base_frame, problem), stamps_.rate(), T_base_camera};
}

Finding CameraInput::judge(const std::optional<Eigen::Isometry3d>& T_base_camera, const std::string& base_frame,
                           const std::string& problem) const {
  const std::string step = "TF";
  if (!frame_) return {step, Verdict::kOpen, "no image came", "see topics"};
  const std::string camera = ros_conversions::cleanFrameId(*frame_);
  if (camera.empty()) return {step, Verdict::kOpen, "the images name no frame", "set frame_id in the driver"};
  if (!T_base_camera)
    return {step, Verdict::kFail, "no transform from " + camera + " to " + base_frame + ": " + problem,
            "publish it: URDF, or static_transform_publisher; launch/cameras has an argument mount_rpy"};
  const Eigen::Vector3d at = T_base_camera->translation(), ahead = T_base_camera->rotation().col(2);
  const std::string what = text(2, camera, " is at ", at.x(), " ", at.y(), " ", at.z(), " m of ", base_frame,
                                " and looks along ", ahead.x(), " ", ahead.y(), " ", ahead.z());
  if (T_base_camera->rotation().isIdentity(1e-3))
    return {step, Verdict::kWarn, what,
            "these are the axes of a body (x ahead), not of a camera (z ahead): give the images their optical frame"};
  return {step, Verdict::kOk, what, ""};
}

}  // namespace sdvo
