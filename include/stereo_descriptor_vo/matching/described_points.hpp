#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Points with a descriptor each: what features are matched to, be it another pair's or a map's.
struct DescribedPoints {
  DescriptorKind kind;
  std::vector<Eigen::Vector3d> positions;  ///< in the reference camera's left optical frame, m
  cv::Mat descriptors;                     ///< rows x bytes, CV_8U

  DescribedPoints() = default;
  /// The points of a pair; shares its descriptors.
  DescribedPoints(const StereoFeatures& features) : kind(features.kind()), descriptors(features.descriptors) {
    positions.reserve(features.u.size());
    for (int i = 0; i < features.count(); ++i) positions.push_back(features.point(i));
  }

  int count() const { return static_cast<int>(positions.size()); }
};

}  // namespace sdvo
