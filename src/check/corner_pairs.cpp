#include "corner_pairs.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace sdvo {

std::optional<CornerPair> CornerPairs::add(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp) {
  constexpr std::int64_t kPeriod = 190'000'000;  // ns
  CornerPair pair{left, right, before_, 1e-9 * static_cast<double>(stamp - stamp_before_), {}};
  before_ = left.clone();
  stamp_before_ = stamp;
  if (pair.before.size() != left.size() || !(pair.dt > 0.0) || (last_ && stamp - *last_ < kPeriod)) return std::nullopt;
  last_ = stamp;
  cv::goodFeaturesToTrack(left, pair.corners, 200, 0.01, 8.0);
  return pair;
}

std::vector<std::uint8_t> track(const cv::Mat& from, const cv::Mat& to, const std::vector<cv::Point2f>& points,
                                std::vector<cv::Point2f>& guess, int levels) {
  std::vector<std::uint8_t> found;
  if (points.empty()) return found;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(from, to, points, guess, found, error, cv::Size(13, 13), levels,
                           cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.01),
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  return found;
}

std::vector<std::uint8_t> trackBothWays(const cv::Mat& from, const cv::Mat& to, const std::vector<cv::Point2f>& points,
                                        std::vector<cv::Point2f>& there, int levels) {
  constexpr int kLevels = 4;       // the motion from pair to pair
  constexpr double kReturn = 0.5;  // px (chosen)
  there = points;
  std::vector<std::uint8_t> found = track(from, to, points, there, kLevels);
  std::vector<cv::Point2f> back = there;
  const std::vector<std::uint8_t> returned = track(to, from, there, back, levels);
  for (std::size_t i = 0; i < found.size(); ++i)
    found[i] = found[i] && returned[i] && distance(back[i], points[i]) <= kReturn;
  return found;
}

double distance(const cv::Point2f& a, const cv::Point2f& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

}  // namespace sdvo
