#pragma once

#include <nav_msgs/Path.h>

#include <Eigen/Geometry>
#include <string>

namespace sdvo {

/// Writes the poses of the base as SaveTrajectory.srv describes it. A file appears whole or not at all. Throws
/// std::runtime_error that names the file, and leaves it as it was, when the format is unknown, the path is not
/// absolute, leads to something else than a file, or may not be written.
void saveTrajectory(const nav_msgs::Path& poses, const Eigen::Isometry3d& T_base_camera, const std::string& format,
                    const std::string& path);

}  // namespace sdvo
