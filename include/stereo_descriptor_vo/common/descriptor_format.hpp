#pragma once

#include <string>
#include <vector>

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

}  // namespace sdvo
