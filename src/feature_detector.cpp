#include "stereo_descriptor_vo/feature_detector.hpp"

#include <algorithm>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

namespace sdvo {
namespace {

/// The score of a FAST corner is the highest threshold at which it still is one. One pass at the lowest threshold, ranked
/// by score inside each bucket, therefore equals running every bucket at its own adaptive threshold.
std::vector<Corner> detectFast(const cv::Mat& image, const FeatureDetectorOptions& options) {
  std::vector<cv::KeyPoint> keypoints;
  cv::FAST(image, keypoints, options.fast_min_threshold, true);
  std::vector<Corner> corners;
  corners.reserve(keypoints.size());
  for (const cv::KeyPoint& keypoint : keypoints) corners.push_back({keypoint.pt, keypoint.response});
  return corners;
}

/// Local maxima of the gradient matrix' smaller eigenvalue (gftt) or of Harris' measure, as in cv::goodFeaturesToTrack,
/// but with the response kept for the buckets.
std::vector<Corner> detectGradientCorners(const cv::Mat& image, const FeatureDetectorOptions& options) {
  constexpr double kHarrisK = 0.04;
  cv::Mat response, neighbourhood_maximum;
  if (options.type == "harris")
    cv::cornerHarris(image, response, options.corner_block_size, 3, kHarrisK);
  else
    cv::cornerMinEigenVal(image, response, options.corner_block_size, 3);
  cv::dilate(response, neighbourhood_maximum, cv::Mat());
  double strongest = 0.0;
  cv::minMaxLoc(response, nullptr, &strongest);
  const float weakest = static_cast<float>(strongest * options.corner_quality);

  std::vector<Corner> corners;
  for (int y = 1; y + 1 < image.rows; ++y) {
    const float* here = response.ptr<float>(y);
    const float* maximum = neighbourhood_maximum.ptr<float>(y);
    for (int x = 1; x + 1 < image.cols; ++x)
      if (here[x] > weakest && here[x] == maximum[x]) corners.push_back({cv::Point2f(x, y), here[x]});
  }
  return corners;
}

/// Foerstner's intersection of gradient lines; a corner that wanders off is not one point, its integer position is kept.
void refinePositions(const cv::Mat& image, int radius, std::vector<Corner>& corners) {
  if (corners.empty()) return;
  constexpr float kLargestShift = 1.5f;  // px
  std::vector<cv::Point2f> positions;
  positions.reserve(corners.size());
  for (const Corner& corner : corners) positions.push_back(corner.position);
  cv::cornerSubPix(image, positions, cv::Size(radius, radius), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 10, 0.02));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const cv::Point2f shift = positions[i] - corners[i].position;
    if (std::max(std::abs(shift.x), std::abs(shift.y)) <= kLargestShift) corners[i].position = positions[i];
  }
}

}  // namespace

std::vector<Corner> spreadOverBuckets(std::vector<Corner> corners, cv::Size image_size, int bucket_size,
                                      int max_count) {
  const int columns = (image_size.width + bucket_size - 1) / bucket_size;
  const int rows = (image_size.height + bucket_size - 1) / bucket_size;
  std::vector<std::vector<Corner>> buckets(static_cast<std::size_t>(columns) * rows);
  for (const Corner& corner : corners) {
    const int column = std::clamp(static_cast<int>(corner.position.x) / bucket_size, 0, columns - 1);
    const int row = std::clamp(static_cast<int>(corner.position.y) / bucket_size, 0, rows - 1);
    buckets[static_cast<std::size_t>(row) * columns + column].push_back(corner);
  }
  const auto stronger = [](const Corner& a, const Corner& b) {
    return std::tie(b.response, a.position.y, a.position.x) < std::tie(a.response, b.position.y, b.position.x);
  };
  std::size_t fullest = 0;
  for (auto& bucket : buckets) {
    std::sort(bucket.begin(), bucket.end(), stronger);
    fullest = std::max(fullest, bucket.size());
  }

  // Serve every bucket's strongest corner, then every second strongest, …; the last round goes to the strongest of it.
  std::vector<Corner> kept;
  for (std::size_t round = 0; round < fullest && static_cast<int>(kept.size()) < max_count; ++round) {
    std::vector<Corner> served;
    for (const auto& bucket : buckets)
      if (round < bucket.size()) served.push_back(bucket[round]);
    const std::size_t room = static_cast<std::size_t>(max_count) - kept.size();
    if (served.size() > room) {
      std::sort(served.begin(), served.end(), stronger);
      served.resize(room);
    }
    kept.insert(kept.end(), served.begin(), served.end());
  }
  return kept;
}

FeatureDetector::FeatureDetector(const FeatureDetectorOptions& options) : options_(checked(options)) {}

std::vector<Corner> FeatureDetector::detect(const cv::Mat& image) const {
  CV_Assert(image.type() == CV_8UC1);
  std::vector<Corner> corners =
      options_.type == "fast" ? detectFast(image, options_) : detectGradientCorners(image, options_);
  corners = spreadOverBuckets(std::move(corners), image.size(), options_.bucket_size, options_.max_features);
  if (options_.subpixel) refinePositions(image, options_.subpixel_radius, corners);
  return corners;
}

}  // namespace sdvo
