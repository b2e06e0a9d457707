#pragma once

#include <stereo_descriptor_vo/StereoFeatures.h>

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

#include "stereo_descriptor_vo/common/cpp17.hpp"
#include "stereo_descriptor_vo/common/descriptor_format.hpp"

namespace sdvo {

/// A StereoFeatures message, checked once and then read without a copy. For every node that subscribes to descriptors.
/// The message must outlive the view and its matrices. These are read-only, which cv::Mat cannot express.
class StereoFeaturesView {
 public:
  /// Checks all fields before they are read. Throws std::invalid_argument that names an inconsistent one.
  explicit StereoFeaturesView(const stereo_descriptor_vo::StereoFeatures& message) : message_(message) {
    checkGeometry();
    checkRows();
    const std::string fault = faultOfArrays(message, message.image_width, message.image_height);
    if (!fault.empty()) refuse(fault);
  }

  const stereo_descriptor_vo::StereoFeatures& message() const { return message_; }
  int count() const { return static_cast<int>(message_.u.size()); }
  bool hasRightHalf() const { return message_.layout == nameOf(DescriptorLayout::kLeftAndRight); }

  /// All rows, count() x elements: CV_8U, or CV_32F for element_type "float32".
  cv::Mat descriptors() const { return columns(0, rowElements()); }
  /// The left halves alone, count() x elements of one view.
  cv::Mat leftDescriptors() const { return columns(0, viewElements()); }
  /// The right halves alone; empty when the layout is "left".
  cv::Mat rightDescriptors() const { return hasRightHalf() ? columns(viewElements(), rowElements()) : cv::Mat(); }

  /// Grey patches, count() x patch_side^2, CV_8U; empty when none are sent.
  cv::Mat patches() const {
    if (count() == 0 || message_.patch_side == 0) return cv::Mat();
    return cv::Mat(count(), patchLayout().bytes(), CV_8U, const_cast<std::uint8_t*>(message_.patches.data()));
  }
  PatchLayout patchLayout() const {
    return {static_cast<int>(message_.patch_side), message_.patch_min_spacing, message_.patch_spacing};
  }
  /// Distance of neighbouring samples of feature i's patch, px.
  float patchSpacing(int i) const { return patchLayout().spacing(message_.size[i]); }

  /// Position of feature i in the left rectified optical frame, m.
  cv::Point3d point(int i) const {
    const double z = message_.fx * message_.baseline / message_.disparity[i];
    return {(message_.u[i] - message_.cx) * z / message_.fx, (message_.v[i] - message_.cy) * z / message_.fy, z};
  }

 private:
  template <class... Parts>
  [[noreturn]] static void refuse(const Parts&... parts) {
    std::ostringstream what;
    (what << ... << parts);
    throw std::invalid_argument("StereoFeatures message refused: " + what.str());
  }

  bool isFloat() const { return message_.element_type == nameOf(ElementType::kFloat32); }
  int rowElements() const { return static_cast<int>(message_.bytes_per_row / (isFloat() ? 4 : 1)); }
  int viewElements() const { return hasRightHalf() ? rowElements() / 2 : rowElements(); }

  cv::Mat columns(int first, int last) const {
    if (count() == 0) return cv::Mat();
    const cv::Mat rows(count(), rowElements(), isFloat() ? CV_32F : CV_8U,
                       const_cast<std::uint8_t*>(message_.descriptors.data()), message_.bytes_per_row);
    return rows.colRange(first, last);
  }

  void checkGeometry() const {
    const auto positive = [](double x) { return std::isfinite(x) && x > 0.0; };
    if (!positive(message_.fx) || !positive(message_.fy) || !positive(message_.baseline) ||
        !std::isfinite(message_.cx) || !std::isfinite(message_.cy))
      refuse("fx, fy and baseline must be positive, cx and cy finite");
    constexpr float kLongestDelay = 1.f;  // s, the largest that max_interval may be
    if (!(std::abs(message_.right_delay) <= kLongestDelay)) refuse("right_delay is not within ", kLongestDelay, " s");
    // Receivers allocate tables of the image's size, and their time grows with the number of features.
    constexpr std::uint32_t kLargestSide = 1u << 14;
    const std::uint32_t width = message_.image_width, height = message_.image_height;
    if (width == 0 || height == 0 || width > kLargestSide || height > kLargestSide)
      refuse("image size ", width, "x", height);
  }

  void checkRows() const {
    const std::size_t n = message_.u.size();
    constexpr std::size_t kMostFeatures = 20000;
    if (n > kMostFeatures) refuse(n, " features, more than ", kMostFeatures, " are not accepted");
    if (!indexOf(namesOf(DescriptorLayout{}), message_.layout)) refuse("unknown layout '", message_.layout, "'");
    if (!indexOf(namesOf(ElementType{}), message_.element_type))
      refuse("unknown element_type '", message_.element_type, "'");
    constexpr std::uint32_t kLongestRow = 1u << 15;
    const std::uint32_t unit = (isFloat() ? 4u : 1u) * (hasRightHalf() ? 2u : 1u), row = message_.bytes_per_row;
    if (row == 0 || row > kLongestRow || row % unit != 0)
      refuse("bytes_per_row = ", row, " does not fit layout and element_type");
    if (message_.descriptors.size() != n * row)
      refuse("descriptors has ", message_.descriptors.size(), " bytes, ", n, " rows of ", row, " need ", n * row);
    constexpr std::uint32_t kLargestPatch = 64;
    if (message_.patch_side > kLargestPatch) refuse("patch_side = ", message_.patch_side);
    const std::size_t patch = std::size_t(message_.patch_side) * message_.patch_side;
    if (message_.patches.size() != n * patch)
      refuse("patches has ", message_.patches.size(), " bytes, ", n, " patches of ", patch, " samples need ",
             n * patch);
    if (!patchLayout().isUsable()) refuse("patch_min_spacing must be positive, patch_spacing must not be negative");
  }

  const stereo_descriptor_vo::StereoFeatures& message_;
};

}  // namespace sdvo
