#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Up to four poses.
class PoseCandidates {
 public:
  void add(const Eigen::Isometry3d& T) { poses_[count_++] = T; }
  std::size_t size() const { return count_; }
  const Eigen::Isometry3d* begin() const { return poses_.data(); }
  const Eigen::Isometry3d* end() const { return poses_.data() + count_; }

 private:
  std::array<Eigen::Isometry3d, 4> poses_;
  std::size_t count_ = 0;
};

/// T_camera_reference of a camera that sees three points of the reference frame along three rays of length one: all
/// poses with the points in front of it. None where the points lie on one line.
PoseCandidates solveThreePointPose(const std::array<Eigen::Vector3d, 3>& points,
                                   const std::array<Eigen::Vector3d, 3>& rays);

}  // namespace sdvo
