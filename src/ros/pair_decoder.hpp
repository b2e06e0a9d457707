#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_input.hpp"

namespace sdvo {

/// What the core takes of a pair. The images share the messages' memory where they can.
struct DecodedPair {
  StereoCamera camera;
  cv::Mat left, right;  ///< CV_8U grey
};

/// Turns the messages of one stream into what the core takes: with a camera that stays what it is but for rounding
/// (some drivers compute P anew for each image) and one depth of mono16, so that grey levels keep their meaning.
class PairDecoder {
 public:
  /// Throws std::invalid_argument as toStereoCamera() and toGrey() do.
  DecodedPair decode(const StereoPairMessages& pair);

  /// The pair's camera proved to fit its images: it is the stream's from now on. Whether that was another one before.
  bool accept(const StereoCamera& camera);

  /// Of the brightest pixel so far; 8 unless images are mono16.
  int bitDepth() const { return bit_depth_; }

 private:
  std::optional<StereoCamera> camera_;
  int bit_depth_ = 8;
};

}  // namespace sdvo
