#include "pair_decoder.hpp"

#include <utility>

#include "camera_conversions.hpp"

namespace sdvo {

DecodedPair PairDecoder::decode(const StereoPairMessages& pair) {
  const StereoCamera camera = ros_conversions::toStereoCamera(*pair.left_info, *pair.right_info);
  const bool new_range = grey_.add(*pair.left_image, *pair.right_image);
  return {camera, ros_conversions::toGrey(pair.left_image, grey_.range()),
          ros_conversions::toGrey(pair.right_image, grey_.range()), new_range};
}

PairDecoder::Change PairDecoder::accept(const StereoCamera& camera) {
  if (camera_ && camera_->isLike(camera)) return Change::kNone;
  return std::exchange(camera_, camera) ? Change::kOther : Change::kFirst;
}

}  // namespace sdvo
