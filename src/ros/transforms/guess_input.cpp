#include "guess_input.hpp"

#include <ros/init.h>

#include "../../messages/frames.hpp"
#include "../../messages/stamps.hpp"

namespace sdvo {

std::optional<MotionGuess> GuessInput::await(const Begin& begin, const std_msgs::Header& header,
                                             const Eigen::Isometry3d& T_base_camera,
                                             const std::function<bool()>& is_void, std::string& problem) {
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

std::optional<Eigen::Isometry3d> GuessInput::base(const ros::Time& time) const {
  std::string ignored;
  return transforms_.find(options_.guess_frame_id, options_.base_frame_id, ignored, time);
}

std::optional<MotionGuess> GuessInput::ofFrame(const Begin& begin, const ros::Time& stamp,
                                               const Eigen::Isometry3d& T_base_camera, std::string& problem) const {
  const std::string &fixed = options_.guess_frame_id, &base = options_.base_frame_id;
  std::optional<Eigen::Isometry3d> T_begin_now;
  if (!begin.T_guess_base)
    T_begin_now = transforms_.findMotion(fixed, base, begin.stamp, stamp, problem);
  else if (const auto T_guess_base = transforms_.find(fixed, base, problem, stamp))
    T_begin_now = begin.T_guess_base->inverse() * *T_guess_base;
  if (!T_begin_now) return std::nullopt;
  return MotionGuess{T_base_camera.inverse() * *T_begin_now * T_base_camera};
}

std::optional<MotionGuess> GuessInput::ofGyro(const ros::Time& begin, const std_msgs::Header& header,
                                              std::string& problem) const {
  const std::optional<Eigen::Matrix3d> R_begin_now = imu_->rotation(
      ros_conversions::cleanFrameId(header.frame_id), nanoseconds(begin), nanoseconds(header.stamp), problem);
  if (!R_begin_now) return std::nullopt;
  MotionGuess guess;
  guess.T_previous_current.linear() = *R_begin_now;
  guess.rotation_only = true;
  return guess;
}

}  // namespace sdvo
