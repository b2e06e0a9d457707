#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "finding.hpp"

namespace sdvo {

/// Whether the axes of a camera frame on TF are those of an optical frame.
Finding checkMount(const std::string& base_frame, const std::string& camera_frame,
                   const Eigen::Isometry3d& T_base_camera);

/// Whether the frame of the left images is an optical one (z ahead). With a body frame (x ahead, z up) instead, a
/// driving robot appears to rise. A camera that really looks up may rise, too. The top of its image is then seldom to a
/// side of the robot, and the robot turns about the optical axis.
class OpticalAxisCheck {
 public:
  /// `T_previous_current`: of the camera since the pair before.
  void add(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_previous_current);

  Finding judge() const;

 private:
  double along_axis_ = 0.0, distance_ = 0.0;      ///< m, while the axis points up
  double about_axis_ = 0.0, about_others_ = 0.0;  ///< rad
  bool is_sideways_ = false;                      ///< the x axis, ahead in a body frame, is to the robot's side
};

/// Whether rotations by the gyro, mounted as on TF, have the same axes as those by the images. If not, the gyro's
/// stamps may be shifted in time.
class GyroAxesCheck {
 public:
  /// Rotation by the gyro between two stamps (ns), in the camera's axes; none without measurements.
  using Gyro = std::function<std::optional<Eigen::Matrix3d>(std::int64_t from, std::int64_t to)>;

  /// Rotations of one pair between two stamps (ns), in the camera's axes.
  void add(std::int64_t from, std::int64_t to, const Eigen::Matrix3d& by_gyro, const Eigen::Matrix3d& by_images);

  Finding judge(const Gyro& gyro) const;

 private:
  struct Turns {
    double product = 0.0, of_gyro = 0.0, of_images = 0.0;  ///< sums of products and squares, rad^2

    void add(const Eigen::Vector3d& by_gyro, const Eigen::Vector3d& by_images);
    double cosine() const;
  };
  struct Pair {
    std::int64_t from, to;
    Eigen::Vector3d by_gyro, by_images;  ///< rotation vectors, rad
  };

  double turned_ = 0.0;     ///< by pairs_, rad
  std::deque<Pair> pairs_;  ///< the last ones that turned: older ones are of another time
};

}  // namespace sdvo
