#pragma once

#include "../map/mount_tilt.hpp"
#include "finding.hpp"

namespace sdvo {

/// Whether a base drives along the floor as the camera's mount on TF has it.
class MountCheck {
 public:
  /// `T_previous_current`: of the camera since the pair before. Another mount begins anew.
  void add(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_previous_current) {
    tilt_.add(T_base_camera, T_previous_current);
  }

  /// `tilt_sigma`: deg, as the mount is trusted beforehand.
  Finding judge(double tilt_sigma) const;

 private:
  MountTilt tilt_{PlanarOptions()};
};

}  // namespace sdvo
