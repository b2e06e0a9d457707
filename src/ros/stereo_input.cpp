#include "stereo_input.hpp"

#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

namespace sdvo {

StereoInput::StereoInput(ros::NodeHandle& nh, StereoImageTransport& transport, const StereoInputOptions& options,
                         Callback callback)
    : callback_(std::move(callback)), smallest_gap_(std::numeric_limits<double>::infinity()) {
  const std::string topics[kInputs] = {"left/image_rect", "right/image_rect", "left/camera_info", "right/camera_info"};
  for (int input = 0; input < kInputs; ++input) arrivals_[input].topic = nh.resolveName(topics[input]);

  left_image_.registerCallback<const sensor_msgs::ImageConstPtr&>(counter<sensor_msgs::ImageConstPtr>(0));
  right_image_.registerCallback<const sensor_msgs::ImageConstPtr&>(counter<sensor_msgs::ImageConstPtr>(1));
  left_info_.registerCallback<const sensor_msgs::CameraInfoConstPtr&>(counter<sensor_msgs::CameraInfoConstPtr>(2));
  right_info_.registerCallback<const sensor_msgs::CameraInfoConstPtr&>(counter<sensor_msgs::CameraInfoConstPtr>(3));

  const auto queue = static_cast<std::uint32_t>(options.queue_size);
  if (options.approximate_sync) {
    ApproximatePolicy policy(queue);
    policy.setMaxIntervalDuration(ros::Duration(options.max_interval));
    approximate_ = std::make_unique<message_filters::Synchronizer<ApproximatePolicy>>(
        static_cast<const ApproximatePolicy&>(policy), left_image_, right_image_, left_info_, right_info_);
    approximate_->registerCallback(&StereoInput::onPair, this);
  } else {
    exact_ = std::make_unique<message_filters::Synchronizer<ExactPolicy>>(ExactPolicy(queue), left_image_, right_image_,
                                                                          left_info_, right_info_);
    exact_->registerCallback(&StereoInput::onPair, this);
  }

  left_image_.subscribe(nh, topics[0], queue, transport.left(), transport.hints());
  right_image_.subscribe(nh, topics[1], queue, transport.right(), transport.hints());
  left_info_.subscribe(nh, topics[2], queue);
  right_info_.subscribe(nh, topics[3], queue);
}

std::string StereoInput::explainSilence() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::ostringstream text;
  if (pairs_ == 0) {
    text << "no synchronised stereo pair; received:";
    for (const Arrivals& arrivals : arrivals_) {
      text << " " << arrivals.topic << " " << arrivals.count;
      if (arrivals.count > 0 && arrivals.last_stamp.isZero()) text << " (stamp is zero)";
    }
    if (std::isfinite(smallest_gap_))
      text << "; smallest gap between a left and a right image stamp " << smallest_gap_
           << " s (set approximate_sync if the cameras are not triggered together)";
  }
  for (Arrivals& arrivals : arrivals_) arrivals.count = 0;
  pairs_ = 0;
  smallest_gap_ = std::numeric_limits<double>::infinity();
  return text.str();
}

void StereoInput::onMessage(int input, const ros::Time& stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++arrivals_[input].count;
  arrivals_[input].last_stamp = stamp;
  if (input < 2 && arrivals_[1 - input].count > 0)
    smallest_gap_ = std::min(smallest_gap_, std::abs((stamp - arrivals_[1 - input].last_stamp).toSec()));
}

void StereoInput::onPair(const sensor_msgs::ImageConstPtr& left_image, const sensor_msgs::ImageConstPtr& right_image,
                         const sensor_msgs::CameraInfoConstPtr& left_info,
                         const sensor_msgs::CameraInfoConstPtr& right_info) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++pairs_;
  }
  callback_({left_image, right_image, left_info, right_info});
}

}  // namespace sdvo
