#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "base_descriptor.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/options/feature_extractor_options.hpp"

namespace sdvo {

/// A key point seen in both views, as the stereo descriptor needs it.
struct StereoKeypoint {
  float u_left, v_left;    ///< px
  float u_right, v_right;  ///< px
  float size;              ///< diameter, the same in both views, px
};

/// Descriptors of those key points that can be described in both views.
struct DescribedKeypoints {
  std::vector<int> index;    ///< into the key points given, ascending; one for each row
  std::vector<float> angle;  ///< rad in [0, 2 pi), -1 where not oriented; one for each row
  cv::Mat rows;              ///< row = left half, or left half then right half
};

/// The stereo descriptor (paper, section 4.2): left half and right half of one feature, both described at the same
/// depth-derived size. Rows stay aligned because a key point is described in all views or in none.
class StereoDescriptor {
 public:
  explicit StereoDescriptor(const DescriptorOptions& options);

  DescribedKeypoints describe(const cv::Mat& left_image, const cv::Mat& right_image,
                              const std::vector<StereoKeypoint>& keypoints) const;

  /// Least distance, px, of a described key point of `size` px from the image's border.
  double reach(double size) const;
  /// Size in px whose neighbourhood is as wide as the image's shorter side; a larger one shows more border than image.
  double largestSize(cv::Size image) const;
  ElementType elementType() const { return base_->elementType(); }
  const DescriptorOptions& options() const { return options_; }

 private:
  DescriptorOptions options_;
  std::unique_ptr<BaseDescriptor> base_;
};

}  // namespace sdvo
