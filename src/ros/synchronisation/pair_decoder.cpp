#include "pair_decoder.hpp"

#include <stdexcept>
#include <utility>

namespace sdvo {
namespace {

cv::Mat greyOf(const char* side, const sensor_msgs::ImageConstPtr& image, const ros_conversions::GreyRange& range) try {
  return ros_conversions::toGrey(image, range);
} catch (const std::invalid_argument& e) {
  throw std::invalid_argument(std::string(side) + " image: " + e.what());
}

}  // namespace

/// The first transform that is found is kept: rounding on TF would make a new camera of each pair.
PairDecoder::PairDecoder(ros_conversions::FindTransform find) {
  if (!find) return;
  find_ = [find = std::move(find), parts = std::string(), found = std::optional<Eigen::Isometry3d>()](
              const std::string& parent, const std::string& child, std::string& problem) mutable {
    if (std::exchange(parts, parent + " " + child) != parts) found.reset();
    if (!found) found = find(parent, child, problem);
    return found;
  };
}

DecodedPair PairDecoder::decode(const StereoPairMessages& pair) {
  const StereoCamera camera = ros_conversions::toStereoCamera(*pair.left_info, *pair.right_info, find_);
  const bool new_range = grey_.add(*pair.left_image, *pair.right_image);
  return {camera, greyOf("left", pair.left_image, grey_.range()), greyOf("right", pair.right_image, grey_.range()),
          new_range};
}

PairDecoder::Change PairDecoder::accept(const StereoCamera& camera) {
  if (camera_ && camera_->isLike(camera)) return Change::kNone;
  return std::exchange(camera_, camera) ? Change::kOther : Change::kFirst;
}

}  // namespace sdvo
