#include "stereo_descriptor_vo/places/eased_transform.hpp"

namespace sdvo {

void EasedTransform::moveTo(const Eigen::Isometry3d& target, double now) {
  from_ = at(now);
  target_ = target;
  begin_ = now;
}

Eigen::Isometry3d EasedTransform::at(double now) const {
  // Before its begin: the clock was set back, and what was on its way has arrived.
  if (now < begin_ || now >= begin_ + duration_) return target_;
  const double passed = (now - begin_) / duration_;
  const double share = passed * passed * (3.0 - 2.0 * passed);
  const Eigen::Quaterniond from(from_.linear()), target(target_.linear());
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = from.slerp(share, target).toRotationMatrix();
  T.translation() = from_.translation() + share * (target_.translation() - from_.translation());
  return T;
}

}  // namespace sdvo
