#include "pair_decoder.hpp"

#include <algorithm>

#include "camera_conversions.hpp"
#include "image_conversions.hpp"

namespace sdvo {

DecodedPair PairDecoder::decode(const StereoPairMessages& pair) {
  const StereoCamera given = ros_conversions::toStereoCamera(*pair.left_info, *pair.right_info);
  bit_depth_ =
      std::max({bit_depth_, ros_conversions::bitDepth(*pair.left_image), ros_conversions::bitDepth(*pair.right_image)});
  return {camera_ && isSameCamera(*camera_, given) ? *camera_ : given,
          ros_conversions::toGrey(pair.left_image, bit_depth_), ros_conversions::toGrey(pair.right_image, bit_depth_)};
}

bool PairDecoder::accept(const StereoCamera& camera) {
  const bool changed = camera_ && *camera_ != camera;
  camera_ = camera;
  return changed;
}

}  // namespace sdvo
