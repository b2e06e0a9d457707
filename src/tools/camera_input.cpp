#include "camera_input.hpp"

#include <nav_msgs/Odometry.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <limits>
#include <stdexcept>
#include <utility>

#include "../check/axes_check.hpp"
#include "../messages/frames.hpp"
#include "../messages/stamps.hpp"
#include "../ros/transforms/transforms.hpp"

namespace sdvo {

namespace {

/// Messages of each topic that wait for partners. Some never come, and images take memory.
constexpr int kWaiting = 100;

}  // namespace

CameraInput::CameraInput(const StereoTopics& topics, std::optional<StereoInfos> infos, const PairingOptions& pairing,
                         Use use)
    : topics_(topics),
      infos_(std::move(infos)),
      use_(std::move(use)),
      arrivals_(
          [&] {
            StereoInputOptions options;
            options.pairing = pairing;
            return options;
          }(),
          unused_, std::numeric_limits<double>::infinity()),
      exact_(
          kWaiting, pairing.sync_tolerance, [this](const auto&... messages) { onPair(messages...); },
          [this](const auto&...) { ++given_up_; }) {
  if (pairing.approximate_sync)
    approximate_.emplace(kWaiting, pairing.max_interval, [this](const auto&... messages) { onPair(messages...); });
  arrivals_.begin(topics, 0.0);  // long ago: a short recording is judged, too
}

void CameraInput::onPair(const MessagePtr& left, const MessagePtr& right, const MessagePtr& left_info,
                         const MessagePtr& right_info) {
  const ros::Time &stamp = left->header.stamp, &of_right = right->header.stamp;
  ++paired_;
  arrivals_.notePair(nanoseconds(stamp), nanoseconds(of_right), newest_.toSec());
  use_({{left->image, right->image, left_info->info, right_info->info},
        nanoseconds(stamp),
        newest_,
        approximate_ ? secondsBetween(stamp, of_right) : 0.0,
        {left->recorded, right->recorded}});
}

int CameraInput::unused() const {
  return unusable_ + (approximate_ ? std::max(lefts_ - paired_, 0) : given_up_ + static_cast<int>(exact_.waiting()));
}

std::string CameraInput::problem() {
  return problem_.empty() ? arrivals_.explainSilence(newest_.toSec()) : problem_;
}

template <int input>
void CameraInput::pair(const MessagePtr& message) {
  if (approximate_)
    approximate_->add<input>(message);
  else
    exact_.add<input>(message);
}

void CameraInput::add(const StereoMessage& message) {
  const ros::Time& stamp = message.header.stamp;
  const auto input = static_cast<ArrivalLog::Input>(message.input);
  newest_ = message.arrival;
  arrivals_.note(input, nanoseconds(stamp), newest_.toSec());
  if (input == ArrivalLog::kLeftImage) {
    ++lefts_;
    frame_ = message.header.frame_id;
    left_stamps_.insert(nanoseconds(stamp));
  }
  if (const std::string why = whyUnusable(stamp); !why.empty()) {
    ++unusable_;
    problem_ = topics_[input] + ": " + why;
  } else {
    const auto shared = boost::make_shared<const StereoMessage>(message);
    if (input == ArrivalLog::kLeftImage) pair<ArrivalLog::kLeftImage>(shared);
    if (input == ArrivalLog::kRightImage) pair<ArrivalLog::kRightImage>(shared);
    if (input == ArrivalLog::kLeftInfo) pair<ArrivalLog::kLeftInfo>(shared);
    if (input == ArrivalLog::kRightInfo) pair<ArrivalLog::kRightInfo>(shared);
  }
  if (!infos_ || !message.image) return;
  const auto info = boost::make_shared<sensor_msgs::CameraInfo>((*infos_)[message.input]);
  info->header = message.header;
  add(toStereoMessage(message.input + 2, message.arrival, sensor_msgs::CameraInfoConstPtr(info)));
}

void CameraInput::add(const tf2_msgs::TFMessage& message, bool is_static) {
  has_transforms_ = true;
  for (const geometry_msgs::TransformStamped& transform : message.transforms)
    if (transform.header.stamp.isZero() || whyUnusable(transform.header.stamp).empty())
      transforms_.setTransform(transform, "check_camera", is_static);
}

void CameraInput::add(const rosbag::MessageInstance& instance) {
  if (const auto odometry = instance.instantiate<nav_msgs::Odometry>()) {
    bases_.insert(ros_conversions::cleanFrameId(odometry->child_frame_id));
    return;
  }
  if (instance.getTopic() != "/tf" && instance.getTopic() != "/tf_static") {
    StereoMessage message = readStereoMessage(instance, topics_);
    message.recorded = std::make_shared<const rosbag::MessageInstance>(instance);
    return add(message);
  }
  try {
    if (const auto transforms = readAs<tf2_msgs::TFMessage>(instance))
      add(*transforms, instance.getTopic() == "/tf_static");
    else
      tf_problem_ = instance.getTopic() + " holds " + instance.getDataType();
  } catch (const std::runtime_error& e) {
    tf_problem_ = e.what();
  }
}

std::optional<Eigen::Isometry3d> CameraInput::find(const std::string& parent, const std::string& child,
                                                   std::string& problem) const try {
  return tf2::transformToEigen(transforms_.lookupTransform(parent, child, ros::Time(0)));
} catch (const tf2::TransformException& e) {
  problem = e.what();
  return std::nullopt;
}

std::string CameraInput::baseAbove(const std::string& frame) const {
  for (const std::string& above : ancestorsOf(frame, transforms_))
    if (bases_.count(above) > 0) return above;
  return "base_link";
}

ArrivalFindings CameraInput::findings(const std::string& base_frame_given, bool is_recorded) {
  ArrivalFindings found = arrivals_.findings({});
  const std::string camera = ros_conversions::cleanFrameId(frame_.value_or(""));
  const std::string base_frame = base_frame_given.empty() ? baseAbove(camera) : base_frame_given;
  try {
    found.T_base_camera = tf2::transformToEigen(transforms_.lookupTransform(base_frame, camera, ros::Time(0)));
    found.transform = checkMount(base_frame, camera, *found.T_base_camera);
  } catch (const tf2::TransformException&) {
    if (is_recorded && !has_transforms_ && tf_problem_.empty())
      found.transform = {Verdict::kOpen, "this recording has none", "the odometry needs it while it runs"};
    else if (!frame_)
      found.transform = {Verdict::kOpen, "no image came", "see topics"};
    else
      found.transform = explainMissing(base_frame, camera, transforms_);
    if (camera.empty()) found.transform.verdict = Verdict::kOpen;
    if (found.transform.isFault() && !tf_problem_.empty()) found.transform.what += "; " + tf_problem_;
  }
  return found;
}

}  // namespace sdvo
