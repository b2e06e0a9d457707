#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "recording.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"

namespace sdvo {

/// The left image of a pair with its features, CV_8UC3.
cv::Mat drawLeft(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result);

/// Left images of a drive with their features: twelve spread over all pairs, and the first four where tracking ends.
class DrivePictures {
 public:
  struct Picture {
    cv::Mat image;  ///< CV_8UC3
    std::string words;
  };

  explicit DrivePictures(int pairs) : pairs_(pairs) {}

  /// The next pair.
  void add(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result);

  const std::vector<Picture>& pictures() const { return pictures_; }

 private:
  static constexpr int kSpread = 12, kEnds = 4;

  int pairs_, seen_ = 0, spread_ = 0, ends_ = 0;
  std::int64_t first_stamp_ = 0;  ///< ns
  bool was_tracking_ = true;
  std::vector<Picture> pictures_;
};

}  // namespace sdvo
