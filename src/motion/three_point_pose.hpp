#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Up to four solutions, on the stack: thousands of triangles are solved for a pair.
template <class Solution>
class UpToFour {
 public:
  void add(const Solution& solution) { solutions_[count_++] = solution; }
  std::size_t size() const { return count_; }
  const Solution* begin() const { return solutions_.data(); }
  const Solution* end() const { return solutions_.data() + count_; }

 private:
  std::array<Solution, 4> solutions_;
  std::size_t count_ = 0;
};
using PoseCandidates = UpToFour<Eigen::Isometry3d>;

/// T_camera_reference of a camera that sees three points of the reference frame along three rays of length one: all
/// poses with the points in front of it. None where the points lie on one line.
PoseCandidates solveThreePointPose(const std::array<Eigen::Vector3d, 3>& points,
                                   const std::array<Eigen::Vector3d, 3>& rays);

}  // namespace sdvo
