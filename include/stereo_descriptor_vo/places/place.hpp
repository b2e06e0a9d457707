#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// A key frame by which a place is recognised: some of a pair's features, and the pair's pose.
struct Place {
  int id = 0;              ///< running number, from 0
  int segment = 0;         ///< counts the breaks, motions that are unknown
  double travelled = 0.0;  ///< distance since the start, m
  /// Pose as the odometry reported it. The corrected pose, T_map_camera, is a node of the graph.
  Eigen::Isometry3d T_odom_camera = Eigen::Isometry3d::Identity();
  StereoFeatures features;  ///< without patches

  /// Memory that it takes, without its words in the index.
  std::size_t bytes() const;
};

/// A pair with at most `most` of its features and without patches. They are spread over the image: the cells of an 8x4
/// grid take turns and give their strongest ones.
StereoFeatures thinOut(const StereoFeatures& features, int most);

/// The words of a place's descriptors, ascending, none twice. An index has nothing else of a place, and another robot
/// needs nothing else to ask whether a place is known.
using PlaceSignature = std::vector<std::uint32_t>;

/// A place that shares words with a query.
struct PlaceCandidate {
  int place;
  double score;  ///< in [0, 1]: share of the query's words that it has, weighted by their rarity
};

/// Result of the geometric check of two pairs.
struct PlaceMatch {
  bool same = false;                                                 ///< both show the same place
  std::string reason;                                                ///< why not
  Eigen::Isometry3d T_place_camera = Eigen::Isometry3d::Identity();  ///< pose of the newer pair
  Matrix6d covariance = Matrix6d::Zero();                            ///< of its right perturbation, m and rad
  int matches = 0, inliers = 0;
  double coverage = 0.0;  ///< by the inliers, share of an 8x4 grid
  double rms = 0.0;       ///< px per coordinate
};

}  // namespace sdvo
