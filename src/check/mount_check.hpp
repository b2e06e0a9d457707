#pragma once

#include "../map/mount_tilt.hpp"
#include "finding.hpp"

namespace sdvo {

/// Whether a base drives along the floor as the camera's mount on TF has it.
class MountCheck {
 public:
  /// `T_before_now`: of the camera since the pair before. Another mount begins anew.
  void add(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_before_now) {
    tilt_.add(T_base_camera, T_before_now);
  }

  /// `tilt_sigma`: deg, as the mount is trusted beforehand.
  Finding judge(double tilt_sigma) const;

 private:
  MountTilt tilt_{PlanarOptions()};
};

}  // namespace sdvo
