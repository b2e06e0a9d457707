#pragma once

#include <Eigen/Geometry>

namespace sdvo {

/// A transform that moves smoothly to its target, so that it never jumps.
class EasedTransform {
 public:
  /// `duration` of a change, s; zero: at once.
  explicit EasedTransform(double duration) : duration_(duration) {}

  /// From now on, s, the transform moves from where it is to the target, with no speed at both ends.
  void moveTo(const Eigen::Isometry3d& target, double now) {
    from_ = at(now);
    target_ = target;
    begin_ = now;
  }

  Eigen::Isometry3d at(double now) const {
    // Before its begin the clock was set back: the change counts as complete.
    if (now < begin_ || now >= begin_ + duration_) return target_;
    const double passed = (now - begin_) / duration_;
    const double share = passed * passed * (3.0 - 2.0 * passed);
    const Eigen::Quaterniond from(from_.linear()), target(target_.linear());
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = from.slerp(share, target).toRotationMatrix();
    T.translation() = from_.translation() + share * (target_.translation() - from_.translation());
    return T;
  }

 private:
  double duration_;
  double begin_ = 0.0;  ///< s
  Eigen::Isometry3d from_ = Eigen::Isometry3d::Identity(), target_ = Eigen::Isometry3d::Identity();
};

}  // namespace sdvo
