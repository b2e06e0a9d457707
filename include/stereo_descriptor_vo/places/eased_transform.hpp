#pragma once

#include <Eigen/Geometry>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// A transform that follows its target smoothly, so that whoever uses it sees no jump.
class EasedTransform {
 public:
  /// `duration` of a change, s; zero: at once.
  explicit EasedTransform(double duration) : duration_(duration) {}

  /// From now on, s, the transform moves from where it is to the target, with no speed at both ends.
  void moveTo(const Eigen::Isometry3d& target, double now);

  Eigen::Isometry3d at(double now) const;

 private:
  double duration_;
  double begin_ = 0.0;  ///< s
  Eigen::Isometry3d from_ = Eigen::Isometry3d::Identity(), target_ = Eigen::Isometry3d::Identity();
};

}  // namespace sdvo
