#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <string>

#include "../../src/motion/rig_calibration.hpp"
#include "experiment_setup.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

/// A sequence and the motion taken for true.
struct ReferenceSequence {
  std::string name;
  KittiSequence images;
  int frames = 0;         ///< pairs used
  Trajectory trajectory;  ///< T_world_camera of each pair used

  Eigen::Isometry3d motion(int from, int to) const {
    return trajectory[static_cast<std::size_t>(to)].inverse() * trajectory[static_cast<std::size_t>(from)];
  }
};

/// Opens a sequence of the setup. Its ground truth is read, or the package's odometry is run over it. Throws
/// std::runtime_error that names what is missing.
ReferenceSequence openSequence(const ExperimentSetup& setup, const std::string& name, ReferenceMotion reference);

/// The same without a trajectory.
ReferenceSequence openImages(const ExperimentSetup& setup, const std::string& name);

/// The error of its rig's disparities that the package's odometry has found at the sequence's end.
RigCalibration estimateRig(const ReferenceSequence& sequence);

}  // namespace sdvo
