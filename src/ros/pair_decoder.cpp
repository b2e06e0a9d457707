#include "pair_decoder.hpp"

#include <stdexcept>
#include <utility>

#include "../messages/camera_conversions.hpp"

namespace sdvo {
namespace {

cv::Mat greyOf(const char* side, const sensor_msgs::ImageConstPtr& image, const ros_conversions::GreyRange& range) try {
  return ros_conversions::toGrey(image, range);
} catch (const std::invalid_argument& e) {
  throw std::invalid_argument(std::string(side) + " image: " + e.what());
}

}  // namespace

DecodedPair PairDecoder::decode(const StereoPairMessages& pair) {
  const StereoCamera camera = ros_conversions::toStereoCamera(*pair.left_info, *pair.right_info);
  const bool new_range = grey_.add(*pair.left_image, *pair.right_image);
  return {camera, greyOf("left", pair.left_image, grey_.range()), greyOf("right", pair.right_image, grey_.range()),
          new_range};
}

PairDecoder::Change PairDecoder::accept(const StereoCamera& camera) {
  if (camera_ && camera_->isLike(camera)) return Change::kNone;
  return std::exchange(camera_, camera) ? Change::kOther : Change::kFirst;
}

}  // namespace sdvo
