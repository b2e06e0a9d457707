#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "../../messages/camera_conversions.hpp"
#include "../../messages/image_conversions.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_input.hpp"

namespace sdvo {

/// A pair as the core's types. Images share the messages' memory if no conversion is needed.
struct DecodedPair {
  StereoCamera camera;
  cv::Mat left, right;     ///< CV_8U grey
  bool new_range = false;  ///< mono16: the mapping to grey levels has changed
};

/// Converts the messages of one stream to the core's types. Each pair has its own camera, because some drivers publish
/// one for each focus of the lens. The mapping of mono16 to grey levels stays from pair to pair.
class PairDecoder {
 public:
  /// `find`: of TF, for a baseline that P does not have. The first transform that it finds is kept: rounding on TF
  /// would make a new camera of each pair.
  explicit PairDecoder(ros_conversions::FindTransform find = {}) {
    if (!find) return;
    find_ = [find = std::move(find), parts = std::string(), found = std::optional<Eigen::Isometry3d>()](
                const std::string& parent, const std::string& child, std::string& problem) mutable {
      if (std::exchange(parts, parent + " " + child) != parts) found.reset();
      if (!found) found = find(parent, child, problem);
      return found;
    };
  }

  /// Throws std::invalid_argument as toStereoCamera() and toGrey() do.
  DecodedPair decode(const StereoPairMessages& pair) {
    const StereoCamera camera = ros_conversions::toStereoCamera(*pair.left_info, *pair.right_info, find_);
    const bool new_range = grey_.add(*pair.left_image, *pair.right_image);
    return {camera, greyOf("left", pair.left_image, grey_.range()), greyOf("right", pair.right_image, grey_.range()),
            new_range};
  }

  /// Takes a camera that fits its images as the stream's. Returns whether it is the first one or another rig.
  enum class Change { kNone, kFirst, kOther };
  Change accept(const StereoCamera& camera) {
    if (camera_ && camera_->isLike(camera)) return Change::kNone;
    return std::exchange(camera_, camera) ? Change::kOther : Change::kFirst;
  }

  /// Of mono16 images.
  const ros_conversions::GreyRange& greyRange() const { return grey_.range(); }

 private:
  static cv::Mat greyOf(const char* side, const sensor_msgs::ImageConstPtr& image,
                        const ros_conversions::GreyRange& range) try {
    return ros_conversions::toGrey(image, range);
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(std::string(side) + " image: " + e.what());
  }

  ros_conversions::FindTransform find_;
  std::optional<StereoCamera> camera_;
  ros_conversions::GreyRangeTracker grey_;
};

}  // namespace sdvo
