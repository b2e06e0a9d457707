#pragma once

#include <Eigen/Geometry>
#include <cstddef>

#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// A key frame that a camera may come back to: some of a pair's features and where they were seen from.
struct Place {
  int id = 0;              ///< running number, from 0
  int segment = 0;         ///< one more after each motion that is unknown
  double travelled = 0.0;  ///< way since the start, m
  /// As the odometry reported it; origin: of that odometry's pose. A map puts it somewhere else.
  Eigen::Isometry3d T_odom_camera = Eigen::Isometry3d::Identity();
  StereoFeatures features;  ///< without patches

  /// Of memory, without the index of its words.
  std::size_t bytes() const;
};

/// At most so many rows of a pair, spread over the image: each cell of an 8x4 grid gives its strongest ones in turn.
/// Patches are left behind.
StereoFeatures thinOut(const StereoFeatures& features, int most);

}  // namespace sdvo
