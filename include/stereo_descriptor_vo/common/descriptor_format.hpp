#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/cpp17.hpp"
#include "stereo_descriptor_vo/common/named_enum.hpp"

namespace sdvo {

/// What one row of a descriptor matrix is made of.
enum class ElementType { kBits, kUint8, kFloat32 };

inline const std::vector<std::string>& namesOf(ElementType) {
  static const std::vector<std::string> names = {"bits", "uint8", "float32"};
  return names;
}

/// The views in one row: the left one alone, or the left half followed by the right half.
enum class DescriptorLayout { kLeft, kLeftAndRight };

inline const std::vector<std::string>& namesOf(DescriptorLayout) {
  static const std::vector<std::string> names = {"left", "left+right"};
  return names;
}

/// Positions of a grey patch's samples: side x side of them around the feature's position in the left image, row by
/// row. Each sample is the mean grey level of a square as wide as the distance between samples. This distance is
/// proportional to the feature's size, so patches of one point have the same scale in all images, unless size or
/// distance is at its limit.
struct PatchLayout {
  int side = 0;                 ///< samples; 0: no patches
  float min_spacing = 1.f;      ///< px
  float spacing_by_size = 0.f;  ///< px of spacing for each px of size

  int bytes() const { return side * side; }

  /// Whether patches, if there are any, have samples at a distance.
  bool isUsable() const {
    return side == 0 || (side > 0 && std::isfinite(min_spacing) && min_spacing > 0.f &&
                         std::isfinite(spacing_by_size) && spacing_by_size >= 0.f);
  }

  /// Distance of neighbouring samples in px for a feature of `size` px.
  float spacing(float size) const { return std::max(min_spacing, spacing_by_size * size); }

  bool operator==(const PatchLayout& other) const {
    return side == other.side && min_spacing == other.min_spacing && spacing_by_size == other.spacing_by_size;
  }
  bool operator!=(const PatchLayout& other) const { return !(*this == other); }
};

/// Checks the arrays of StereoFeatures, or of its message: equal lengths, finite numbers, positions in the image of
/// `width` and `height` px. Returns the first fault in words, or an empty string.
template <class Features>
std::string faultOfArrays(const Features& features, double width, double height) {
  constexpr double kAny = std::numeric_limits<float>::max();
  std::string fault;
  const auto check = [&](const std::string& name, const std::vector<float>& values, double above, double most) {
    if (!fault.empty()) return;
    if (values.size() != features.u.size())
      fault = "array " + name + " has " + std::to_string(values.size()) + " elements, u has " +
              std::to_string(features.u.size());
    else if (!std::all_of(values.begin(), values.end(), [&](float x) { return x > above && x <= most; }))
      fault = "array " + name + " holds a number that is not " +
              (most < kAny ? "between " + std::to_string(above) + " and " + std::to_string(most) : "finite");
  };
  check("u", features.u, -1.0, width);  // on the border of a pixel of the border, it is still in the image
  check("v", features.v, -1.0, height);
  check("disparity", features.disparity, 0.0, width);
  check("dv", features.dv, -height, height);
  check("size", features.size, 0.0, width + height);
  check("angle", features.angle, -kAny, kAny);
  check("response", features.response, -kAny, kAny);
  return fault;
}

}  // namespace sdvo
