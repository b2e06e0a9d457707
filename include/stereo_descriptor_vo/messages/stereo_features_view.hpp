#pragma once

#include <stereo_descriptor_vo/StereoFeatures.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>

#include "stereo_descriptor_vo/common/cpp17.hpp"
#include "stereo_descriptor_vo/common/descriptor_format.hpp"

namespace sdvo {

/// A StereoFeatures message, checked once and then read without a copy. For every node that subscribes to descriptors.
/// The message must outlive the view and the matrices it hands out; those are read-only although cv::Mat cannot say so.
class StereoFeaturesView {
 public:
  /// Throws std::invalid_argument that says which field does not hold together; nothing is read before it is checked.
  explicit StereoFeaturesView(const stereo_descriptor_vo::StereoFeatures& message) : message_(message) {
    checkGeometry();
    checkLengths();
    checkNumbers();
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
    return cv::Mat(count(), static_cast<int>(message_.patch_side * message_.patch_side), CV_8U,
                   const_cast<std::uint8_t*>(message_.patches.data()));
  }
  /// Distance of neighbouring samples of feature i's patch, px.
  float patchSpacing(int i) const {
    return std::max(message_.patch_min_spacing, message_.patch_spacing * message_.size[i]);
  }

  /// Position of feature i in the left rectified optical frame, m.
  cv::Point3d point(int i) const {
    const double z = message_.fx * message_.baseline / message_.disparity[i];
    return {(message_.u[i] - message_.cx) * z / message_.fx, (message_.v[i] - message_.cy) * z / message_.fy, z};
  }

 private:
  [[noreturn]] static void refuse(const std::string& what) {
    throw std::invalid_argument("StereoFeatures message refused: " + what);
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
    if (!(std::abs(message_.right_delay) <= kLongestDelay))
      refuse("right_delay is not within " + std::to_string(kLongestDelay) + " s");
    // Whoever receives it makes tables of the image's size, and time grows with the number of features.
    constexpr std::uint32_t kLargestSide = 1u << 14;
    if (message_.image_width == 0 || message_.image_height == 0 || message_.image_width > kLargestSide ||
        message_.image_height > kLargestSide)
      refuse("image size " + std::to_string(message_.image_width) + "x" + std::to_string(message_.image_height));
  }

  void checkLengths() const {
    const std::size_t n = message_.u.size();
    constexpr std::size_t kMostFeatures = 20000;
    if (n > kMostFeatures)
      refuse(std::to_string(n) + " features, more than " + std::to_string(kMostFeatures) + " are not accepted");
    const auto require = [n](std::size_t length, const char* name) {
      if (length != n)
        refuse(std::string(name) + " has " + std::to_string(length) + " elements, u has " + std::to_string(n));
    };
    require(message_.v.size(), "v");
    require(message_.disparity.size(), "disparity");
    require(message_.dv.size(), "dv");
    require(message_.size.size(), "size");
    require(message_.angle.size(), "angle");
    require(message_.response.size(), "response");
    if (!indexOf(namesOf(DescriptorLayout{}), message_.layout)) refuse("unknown layout '" + message_.layout + "'");
    if (!indexOf(namesOf(ElementType{}), message_.element_type))
      refuse("unknown element_type '" + message_.element_type + "'");
    constexpr std::uint32_t kLongestRow = 1u << 15;
    const std::uint32_t unit = (isFloat() ? 4u : 1u) * (hasRightHalf() ? 2u : 1u);
    if (message_.bytes_per_row == 0 || message_.bytes_per_row > kLongestRow || message_.bytes_per_row % unit != 0)
      refuse("bytes_per_row = " + std::to_string(message_.bytes_per_row) + " does not fit layout and element_type");
    if (message_.descriptors.size() != n * message_.bytes_per_row)
      refuse("descriptors has " + std::to_string(message_.descriptors.size()) + " bytes, " + std::to_string(n) +
             " rows of " + std::to_string(message_.bytes_per_row) + " need " +
             std::to_string(n * message_.bytes_per_row));
    constexpr std::uint32_t kLargestPatch = 64;
    if (message_.patch_side > kLargestPatch) refuse("patch_side = " + std::to_string(message_.patch_side));
    const std::size_t patch = std::size_t(message_.patch_side) * message_.patch_side;
    if (message_.patches.size() != n * patch)
      refuse("patches has " + std::to_string(message_.patches.size()) + " bytes, " + std::to_string(n) +
             " patches of " + std::to_string(patch) + " samples need " + std::to_string(n * patch));
  }

  void checkNumbers() const {
    const auto finite = [](float x) { return std::isfinite(x); };
    const auto positive = [](float x) { return std::isfinite(x) && x > 0.f; };
    const auto all = [](const std::vector<float>& values, auto holds) {
      return std::all_of(values.begin(), values.end(), holds);
    };
    if (!all(message_.u, finite) || !all(message_.v, finite) || !all(message_.dv, finite) ||
        !all(message_.angle, finite) || !all(message_.response, finite))
      refuse("u, v, dv, angle or response holds a number that is not finite");
    if (!all(message_.disparity, positive) || !all(message_.size, positive))
      refuse("disparity or size holds a number that is not positive and finite");
    const float least = message_.patch_min_spacing, by_size = message_.patch_spacing;
    if (message_.patch_side > 0 && !(positive(least) && finite(by_size) && by_size >= 0.f))
      refuse("patch_min_spacing must be positive, patch_spacing must not be negative");
    // A position on the border of a pixel of the border is still in the image.
    const auto within = [](float end) { return [end](float x) { return x >= -1.f && x <= end; }; };
    const auto width = static_cast<float>(message_.image_width), height = static_cast<float>(message_.image_height);
    if (!all(message_.u, within(width)) || !all(message_.v, within(height)))
      refuse("u or v holds a position outside of the image");
    if (!all(message_.disparity, within(width)) || !all(message_.size, within(width + height)))
      refuse("disparity or size holds a number larger than the image");
  }

  const stereo_descriptor_vo::StereoFeatures& message_;
};

}  // namespace sdvo
