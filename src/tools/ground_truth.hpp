#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

/// True poses of the left camera at these stamps (ns); none where the file knows none. A file in KITTI's format has one
/// pose for each stamp, one in TUM's format stamps of its own, between which poses are interpolated. Throws
/// std::runtime_error that names the file where it cannot be read or fits no stamp.
std::vector<std::optional<Eigen::Isometry3d>> readGroundTruth(const std::string& path,
                                                              const std::vector<std::int64_t>& stamps);

}  // namespace sdvo
