#pragma once

#include <std_msgs/Header.h>

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>

#include "../../config/interface_options.hpp"
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
                                   std::string& problem);

  /// T_guess_base by the other odometry.
  std::optional<Eigen::Isometry3d> base(const ros::Time& time) const;

 private:
  std::optional<MotionGuess> ofFrame(const Begin& begin, const ros::Time& stamp, const Eigen::Isometry3d& T_base_camera,
                                     std::string& problem) const;
  std::optional<MotionGuess> ofGyro(const ros::Time& begin, const std_msgs::Header& header, std::string& problem) const;

  const OdometryOutputOptions options_;
  const RobotTransforms& transforms_;
  const ImuInput* const imu_;
  Patience patience_;
};

}  // namespace sdvo
