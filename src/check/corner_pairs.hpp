#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace sdvo {

/// A pair of a recording with corners to follow from its left image into the others. All images are CV_8UC1 of one
/// size.
struct CornerPair {
  cv::Mat left, right, before;       ///< `before`: left image of the previous pair
  double dt;                         ///< s, since the previous pair
  std::vector<cv::Point2f> corners;  ///< of the left image, px
};

/// Five pairs a second of a recording, which show enough of a rig.
class CornerPairs {
 public:
  /// The next pair of the recording, `stamp` in ns; none where it is not one of the five.
  std::optional<CornerPair> add(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp);

 private:
  cv::Mat before_;
  std::int64_t stamp_before_ = 0;     ///< ns
  std::optional<std::int64_t> last_;  ///< ns: of the last of the five
};

/// Lucas-Kanade from `guess` on, which becomes the result. Whether each point was found. `levels` of the pyramid: 0 for
/// a guess that is good to a few pixels.
std::vector<std::uint8_t> track(const cv::Mat& from, const cv::Mat& to, const std::vector<cv::Point2f>& points,
                                std::vector<cv::Point2f>& guess, int levels);

/// Where points of `from` are in `to`, and whether each was found and returns from there to within half a pixel.
/// `levels` of the pyramid on the way back.
std::vector<std::uint8_t> trackBothWays(const cv::Mat& from, const cv::Mat& to, const std::vector<cv::Point2f>& points,
                                        std::vector<cv::Point2f>& there, int levels);

double distance(const cv::Point2f& a, const cv::Point2f& b);

}  // namespace sdvo
