#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/options/feature_extractor_options.hpp"

namespace sdvo {

/// A key point in one view: the left or the right image of a pair.
struct ViewKeypoint {
  float u, v;   ///< px, sub-pixel
  float size;   ///< diameter, px
  float angle;  ///< rad; negative: upright
};

/// Descriptors of one view: row i belongs to key point i.
struct ViewDescriptors {
  cv::Mat rows;                     ///< CV_8U, one row for each key point; only valid ones are written
  std::vector<std::uint8_t> valid;  ///< 0 where the neighbourhood leaves the image
};

/// A descriptor of one view. A key point of twice the size is described on a neighbourhood of twice the size, whatever
/// the implementation reads (size, octave, level). At 7 px, the size of a FAST corner, it is the published descriptor.
class BaseDescriptor {
 public:
  static constexpr double kStandardSize = DepthScaleOptions::kStandardSize;  ///< px

  virtual ~BaseDescriptor() = default;

  /// `image` is CV_8UC1.
  virtual ViewDescriptors describe(const cv::Mat& image, const std::vector<ViewKeypoint>& keypoints) const = 0;

  /// Distance in px from its centre within which a key point of `size` px needs the image.
  virtual double reach(double size) const = 0;

  virtual ElementType elementType() const = 0;
  virtual int bytes() const = 0;
};

/// Throws std::invalid_argument when the OpenCV at hand lacks the descriptor, saying which build has it.
std::unique_ptr<BaseDescriptor> makeBaseDescriptor(DescriptorType type);

}  // namespace sdvo
