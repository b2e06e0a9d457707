#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "../messages/image_conversions.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_input.hpp"

namespace sdvo {

/// What the core takes of a pair. The images share the messages' memory where they can.
struct DecodedPair {
  StereoCamera camera;
  cv::Mat left, right;     ///< CV_8U grey
  bool new_range = false;  ///< mono16: grey levels mean something else than in the pair before
};

/// Turns the messages of one stream into what the core takes: each pair with its own camera, for some drivers publish
/// one for each focus of the lens, and grey levels that keep their meaning.
class PairDecoder {
 public:
  /// Throws std::invalid_argument as toStereoCamera() and toGrey() do.
  DecodedPair decode(const StereoPairMessages& pair);

  /// The pair's camera proved to fit its images: it is the stream's from now on. Whether it is another rig than before,
  /// or the first one.
  enum class Change { kNone, kFirst, kOther };
  Change accept(const StereoCamera& camera);

  /// Of mono16 images.
  const ros_conversions::GreyRange& greyRange() const { return grey_.range(); }

 private:
  std::optional<StereoCamera> camera_;
  ros_conversions::GreyRangeTracker grey_;
};

}  // namespace sdvo
