#pragma once

#include <ros/init.h>
#include <std_msgs/Header.h>

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>

#include "../../config/interface_options.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/stamps.hpp"
#include "../node/throttles.hpp"
#include "imu_input.hpp"
#include "stereo_descriptor_vo/odometry/motion_guess.hpp"
#include "transforms.hpp"

namespace sdvo {

/// The camera's motion between two pairs by another odometry on TF (guess_frame_id) or by the gyro.
class GuessInput {
 public:
  /// The pair at which a motion begins.
  struct Begin {
    ros::Time stamp;
    /// Of the base by the other odometry. None: it is looked up, which TF allows for some seconds.
    std::optional<Eigen::Isometry3d> T_guess_base;
  };

  /// `imu`: null without use_imu. It and `transforms` must outlive this.
  GuessInput(const OdometryOutputOptions& options, const RobotTransforms& transforms, const ImuInput* imu)
      : options_(options), transforms_(transforms), imu_(imu), patience_(options.guess_timeout) {}

  /// False without another odometry and without a gyro that measures rates.
  bool hasSource() const { return !options_.guess_frame_id.empty() || (imu_ && imu_->hasRates()); }

  /// The motion until the pair of this header. Waits for it, but for guess_timeout at most, and not once `is_void`.
  /// None, with the `problem`, if it does not come.
  std::optional<MotionGuess> await(const Begin& begin, const std_msgs::Header& header,
                                   const Eigen::Isometry3d& T_base_camera, const std::function<bool()>& is_void,
                                   std::string& problem) {
    const auto steadyTime = [] { return ros::SteadyTime::now().toSec(); };
    const double now = steadyTime(), give_up = now + patience_.timeout(now);
    std::optional<MotionGuess> guess;
    for (;;) {
      guess = options_.guess_frame_id.empty() ? ofGyro(begin.stamp, header, problem)
                                              : ofFrame(begin, header.stamp, T_base_camera, problem);
      if (guess || steadyTime() >= give_up || is_void() || !ros::ok()) break;
      ros::WallDuration(0.002).sleep();
    }
    patience_.note(guess.has_value(), now);
    return guess;
  }

  /// T_guess_base by the other odometry.
  std::optional<Eigen::Isometry3d> base(const ros::Time& time) const {
    std::string ignored;
    return transforms_.find(options_.guess_frame_id, options_.base_frame_id, ignored, time);
  }

 private:
  std::optional<MotionGuess> ofFrame(const Begin& begin, const ros::Time& stamp, const Eigen::Isometry3d& T_base_camera,
                                     std::string& problem) const {
    const std::string &fixed = options_.guess_frame_id, &base = options_.base_frame_id;
    std::optional<Eigen::Isometry3d> T_begin_now;
    if (!begin.T_guess_base)
      T_begin_now = transforms_.findMotion(fixed, base, begin.stamp, stamp, problem);
    else if (const auto T_guess_base = transforms_.find(fixed, base, problem, stamp))
      T_begin_now = begin.T_guess_base->inverse() * *T_guess_base;
    if (!T_begin_now) return std::nullopt;
    return MotionGuess{T_base_camera.inverse() * *T_begin_now * T_base_camera};
  }

  std::optional<MotionGuess> ofGyro(const ros::Time& begin, const std_msgs::Header& header,
                                    std::string& problem) const {
    const std::optional<Eigen::Matrix3d> R_begin_now = imu_->rotation(
        ros_conversions::cleanFrameId(header.frame_id), nanoseconds(begin), nanoseconds(header.stamp), problem);
    if (!R_begin_now) return std::nullopt;
    MotionGuess guess;
    guess.T_previous_current.linear() = *R_begin_now;
    guess.rotation_only = true;
    return guess;
  }

  const OdometryOutputOptions options_;
  const RobotTransforms& transforms_;
  const ImuInput* const imu_;
  Patience patience_;
};

}  // namespace sdvo
