#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// The reference of a match: points with a descriptor each, of another pair or of a map.
struct DescribedPoints {
  DescriptorKind kind;
  std::vector<Eigen::Vector3d> positions;  ///< in the reference camera's left optical frame, m
  cv::Mat descriptors;                     ///< one in each row, CV_8U

  DescribedPoints() = default;
  /// The points of a pair; shares its descriptors.
  DescribedPoints(const StereoFeatures& features) : kind(features.kind()), descriptors(features.descriptors) {
    positions.reserve(features.u.size());
    for (int i = 0; i < features.count(); ++i) positions.push_back(features.point(i));
  }

  int count() const { return static_cast<int>(positions.size()); }
};

struct FeatureMatcherOptions {
  double gate_radius = 20.0;  ///< px (chosen), around a predicted left position
  double max_distance = 0.3;  ///< see FeatureMatch::distance (chosen)

  /// For a prediction that may be wrong: three times as far.
  static FeatureMatcherOptions wide() { return {60.0}; }
};

/// A correspondence between described points, of another pair or of a map, and the features of a pair.
struct FeatureMatch {
  int reference;   ///< index of the described point
  int current;     ///< index of the pair's feature
  float distance;  ///< in [0, 1]: share of differing bits, or |a - b|^2 / (|a|^2 + |b|^2)
};

/// Mutual nearest neighbours between the descriptors of two camera positions.
class FeatureMatcher {
 public:
  explicit FeatureMatcher(const FeatureMatcherOptions& options = {}) : options_(options) {}

  const FeatureMatcherOptions& options() const { return options_; }

  /// Returns matches in the order of the reference's points. With a predicted motion, a point is compared only with
  /// features within gate_radius of its predicted position; without one, with all. Throws std::invalid_argument when
  /// the descriptors are of different kinds.
  std::vector<FeatureMatch> match(const DescribedPoints& reference, const StereoFeatures& current,
                                  const std::optional<Eigen::Isometry3d>& T_current_reference) const;

 private:
  FeatureMatcherOptions options_;
};

}  // namespace sdvo
