#pragma once

#include <cstddef>
#include <string>

#include "../../src/messages/camera_conversions.hpp"
#include "../../src/messages/feature_conversions.hpp"
#include "../../src/messages/frames.hpp"
#include "../../src/messages/image_conversions.hpp"
#include "../../src/messages/odometry_conversions.hpp"
#include "../../src/messages/pose_conversions.hpp"
#include "fuzz_bytes.hpp"

namespace sdvo {

/// Sometimes any other bits.
template <class Value>
void replace(Value& value, FuzzBytes& bytes) {
  if (bytes.flag()) value = bytes.any<Value>();
}

inline void replace(std::string& text, FuzzBytes& bytes) {
  if (bytes.flag()) text = bytes.text(12);
}

/// Some elements of any other bits.
template <class Container>
void damageElements(Container& values, FuzzBytes& bytes) {
  while (!values.empty() && bytes.flag()) {
    auto& element = values[bytes.upTo(values.size() - 1)];
    element = bytes.any<std::decay_t<decltype(element)>>();
  }
}

/// Sometimes of another length, with some other elements.
template <class Vector>
void damage(Vector& values, FuzzBytes& bytes) {
  if (bytes.flag()) values.resize(bytes.upTo(64));
  damageElements(values, bytes);
}

inline void damage(stereo_descriptor_vo::StereoFeatures& message, FuzzBytes& bytes) {
  replace(message.image_width, bytes), replace(message.image_height, bytes);
  for (double* value : {&message.fx, &message.fy, &message.cx, &message.cy, &message.baseline}) replace(*value, bytes);
  replace(message.bytes_per_row, bytes), replace(message.stream_epoch, bytes);
  replace(message.patch_side, bytes), replace(message.patch_min_spacing, bytes), replace(message.patch_spacing, bytes);
  replace(message.descriptor, bytes), replace(message.layout, bytes), replace(message.element_type, bytes);
  for (auto* values :
       {&message.u, &message.v, &message.disparity, &message.dv, &message.size, &message.angle, &message.response})
    damage(*values, bytes);
  damage(message.descriptors, bytes);
  damage(message.patches, bytes);
}

}  // namespace sdvo
