#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "finding.hpp"

namespace sdvo {

/// Whether a camera frame at this place on the robot is an optical one, by its axes alone.
Finding checkMount(const std::string& base_frame, const std::string& camera_frame,
                   const Eigen::Isometry3d& T_base_camera);

/// Whether the frame of the left images is an optical one (z ahead). A body's frame (x ahead, z up) in its place makes
/// a robot that drives rise. A camera that really looks up may rise, too: its image's top is then rarely to a side of
/// the robot, and the robot turns about the optical axis.
class OpticalAxisCheck {
 public:
  /// `T_before_now`: of the camera since the pair before.
  void add(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_before_now);

  Finding judge() const;

 private:
  double along_axis_ = 0.0, distance_ = 0.0;      ///< m, while the axis points up
  double about_axis_ = 0.0, about_others_ = 0.0;  ///< rad
  bool is_sideways_ = false;                      ///< as a body's frame the camera looks to the left or right
};

/// Whether a gyro turns about the axes that the images turn about, with TF's word about its mounting. If not, its
/// stamps may be those of another time.
class GyroAxesCheck {
 public:
  /// A rotation by the gyro between two of its stamps, ns, in the camera's axes; none where it has no measurements.
  using Gyro = std::function<std::optional<Eigen::Matrix3d>(std::int64_t from, std::int64_t to)>;

  /// Of one pair, in the camera's axes; `from`, `to`: stamps, ns.
  void add(std::int64_t from, std::int64_t to, const Eigen::Matrix3d& by_gyro, const Eigen::Matrix3d& by_images);

  Finding judge(const Gyro& gyro) const;

 private:
  struct Turns {
    double product = 0.0, of_gyro = 0.0, of_images = 0.0;  ///< sums of products and squares, rad^2

    void add(const Eigen::Matrix3d& by_gyro, const Eigen::Matrix3d& by_images);
    double cosine() const;
  };
  struct Pair {
    std::int64_t from, to;
    Eigen::Matrix3d by_images;
  };

  Turns turns_;
  double turned_ = 0.0;     ///< rad
  std::deque<Pair> pairs_;  ///< of the last seconds
};

}  // namespace sdvo
