#pragma once

#include <Eigen/Geometry>

namespace sdvo::render {

/// Place in metres (x right, y down, z forward); heading from +z towards +x, pitch upwards, roll clockwise, in rad.
inline Eigen::Isometry3d cameraPose(double x, double y, double z, double heading, double pitch, double roll) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() << x, y, z;
  pose.linear() =
      (Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  return pose;
}

}  // namespace sdvo::render
