#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>

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
  /// `find`: of TF, for a baseline that P does not have.
  explicit PairDecoder(ros_conversions::FindTransform find = {});

  /// Throws std::invalid_argument as toStereoCamera() and toGrey() do.
  DecodedPair decode(const StereoPairMessages& pair);

  /// Takes a camera that fits its images as the stream's. Returns whether it is the first one or another rig.
  enum class Change { kNone, kFirst, kOther };
  Change accept(const StereoCamera& camera);

  /// Of mono16 images.
  const ros_conversions::GreyRange& greyRange() const { return grey_.range(); }

 private:
  ros_conversions::FindTransform find_;
  std::optional<StereoCamera> camera_;
  ros_conversions::GreyRangeTracker grey_;
};

}  // namespace sdvo
