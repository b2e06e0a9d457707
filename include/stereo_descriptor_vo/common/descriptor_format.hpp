#pragma once

#include <algorithm>
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
/// row. Each is the mean of a square as wide as their spacing. The spacing follows the feature's size, and so its
/// depth. Hence patches of one point, from two images, differ by a shift; their scales differ only where the size or
/// the spacing is at its limit.
struct PatchLayout {
  int side = 0;                 ///< samples; 0: no patches
  float min_spacing = 1.f;      ///< px
  float spacing_by_size = 0.f;  ///< px of spacing for each px of size

  int bytes() const { return side * side; }

  /// Distance of neighbouring samples in px for a feature of `size` px.
  float spacing(float size) const { return std::max(min_spacing, spacing_by_size * size); }

  bool operator==(const PatchLayout& other) const {
    return side == other.side && min_spacing == other.min_spacing && spacing_by_size == other.spacing_by_size;
  }
  bool operator!=(const PatchLayout& other) const { return !(*this == other); }
};

}  // namespace sdvo
