#include "feature_detector.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <opencv2/core/utility.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "../common/text.hpp"
#include "fast_corners.hpp"
#include "image_noise.hpp"
#include "opencv_features.hpp"

namespace sdvo {
namespace {

/// A PNG as CV_8U. What is transparent is black. Throws std::invalid_argument that names the file when it cannot be
/// read or is larger than any camera's image. By libpng: OpenCV's readers bring a hundred libraries, 40 MB, into every
/// process.
cv::Mat readMask(const std::string& file) {
  constexpr std::uint64_t kMostPixels = 50'000'000;  // stereo cameras have at most 12 million
  const std::string name = "'" + std::filesystem::absolute(file).string() + "'";
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  // Reading from a pipe would block.
  if (!std::filesystem::is_regular_file(file) || png_image_begin_read_from_file(&header, file.c_str()) == 0)
    throw std::invalid_argument("cannot read a PNG from " + name);
  if (std::uint64_t{header.width} * header.height > kMostPixels) {
    png_image_free(&header);
    throw std::invalid_argument(text(0, name, " has ", header.width, "x", header.height,
                                     " px: a mask has the size of the rectified left image"));
  }
  header.format = PNG_FORMAT_GRAY;
  // libpng blends transparent pixels with this black background.
  cv::Mat mask = cv::Mat::zeros(static_cast<int>(header.height), static_cast<int>(header.width), CV_8U);
  if (png_image_finish_read(&header, nullptr, mask.data, static_cast<png_int_32>(mask.step), nullptr) == 0)
    throw std::invalid_argument("cannot read all of the PNG " + name + ": is it truncated?");
  return mask;
}

std::vector<Corner> toCorners(const std::vector<cv::KeyPoint>& keypoints) {
  std::vector<Corner> corners;
  corners.reserve(keypoints.size());
  for (const cv::KeyPoint& keypoint : keypoints) corners.push_back({keypoint.pt, keypoint.response});
  return corners;
}

/// Ratio of the corners requested of OpenCV's detectors to those wanted: the buckets choose among them. The detectors'
/// sizes are not used, since the size follows from the depth.
constexpr int kChoice = 4;

std::vector<Corner> detectOrb(const cv::Mat& image, const FeatureDetectorOptions& options, int threshold) {
  std::vector<cv::KeyPoint> keypoints;
  cv::ORB::create(kChoice * options.max_features, 1.2f, 8, 31, 0, 2, cv::ORB::HARRIS_SCORE, 31, threshold)
      ->detect(image, keypoints);
  return toCorners(keypoints);
}

std::vector<Corner> detectSift(const cv::Mat& image, const FeatureDetectorOptions& options) {
  std::vector<cv::KeyPoint> keypoints;
#if SDVO_HAVE_SIFT
  constexpr double kLooseContrast = 0.005;
  cv::SIFT::create(kChoice * options.max_features, 3, kLooseContrast)->detect(image, keypoints);
#else
  static_cast<void>(image), static_cast<void>(options);  // refused by check()
#endif
  return toCorners(keypoints);
}

constexpr int kGradientWindow = 5;  // px, side of the window of gftt's gradient matrix

/// Local maxima of the gradient matrix' smaller eigenvalue as in cv::goodFeaturesToTrack, but with the response kept
/// for the buckets.
std::vector<Corner> detectGradientCorners(const cv::Mat& image, const FeatureDetectorOptions& options) {
  cv::Mat response, neighbourhood_maximum;
  cv::cornerMinEigenVal(image, response, kGradientWindow, 3);
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

/// `threshold`: least contrast, grey levels, of detectors that have such a limit.
std::vector<Corner> detectAll(const cv::Mat& image, const FeatureDetectorOptions& options, int threshold) {
  switch (options.type) {
    case DetectorType::kFast:
      // The score is the highest threshold at which a corner is found: one pass at the lowest threshold, ranked by
      // score inside each bucket, equals a pass for each bucket at its own threshold.
      return toCorners(findFastCorners(image, threshold));
    case DetectorType::kGftt:
      return detectGradientCorners(image, options);
    case DetectorType::kOrb:
      return detectOrb(image, options, threshold);
    case DetectorType::kSift:
      return detectSift(image, options);
  }
  throw std::invalid_argument("there is no such detector");
}

/// Moves corners to the intersection of the gradient lines around them. Gradient detectors respond up to half of their
/// window inside of a corner. A corner that moves further is no single point and keeps its integer position.
void refineByGradients(const cv::Mat& image, std::vector<Corner>& corners) {
  constexpr int kHalfSide = 3;  // px, of the window: cv::cornerSubPix needs 11 px, less than the smallest image has
  if (corners.empty()) return;
  const cv::Rect2f inside(0.f, 0.f, static_cast<float>(image.cols - 1), static_cast<float>(image.rows - 1));
  constexpr float kLargestShift = 0.5f * kGradientWindow;
  std::vector<cv::Point2f> refined;
  for (const Corner& corner : corners) refined.push_back(corner.position);
  cv::cornerSubPix(image, refined, {kHalfSide, kHalfSide}, {-1, -1},
                   {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 10, 0.02});
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const cv::Point2f shift = refined[i] - corners[i].position;
    if (std::max(std::abs(shift.x), std::abs(shift.y)) <= kLargestShift && inside.contains(refined[i]))
      corners[i].position = refined[i];
  }
}

/// Sub-pixel positions of corners. SIFT has them already. ORB's corners of smaller images are none at full resolution.
void refine(const cv::Mat& image, const FeatureDetectorOptions& options, std::vector<Corner>& corners) {
  switch (options.type) {
    case DetectorType::kFast:
      for (Corner& corner : corners) corner.position += cornerPeak(image, cv::Point(corner.position));
      break;
    case DetectorType::kGftt:
      refineByGradients(image, corners);
      break;
    case DetectorType::kOrb:
    case DetectorType::kSift:
      break;
  }
}

void removeMasked(const cv::Mat& mask, cv::Size size, std::vector<Corner>& corners) {
  if (mask.type() != CV_8UC1) throw std::invalid_argument("the mask must have one channel of eight bits");
  if (mask.size() != size)
    throw std::invalid_argument(text(0, "the mask is ", mask.cols, "x", mask.rows, ", the left image is ", size.width,
                                     "x", size.height, ": make it of the rectified left image"));
  const auto is_masked = [&](const Corner& corner) { return mask.at<std::uint8_t>(cv::Point(corner.position)) == 0; };
  corners.erase(std::remove_if(corners.begin(), corners.end(), is_masked), corners.end());
}

/// Ties are broken by position.
constexpr auto isStronger = [](const Corner& a, const Corner& b) {
  return std::tie(b.response, a.position.y, a.position.x) < std::tie(a.response, b.position.y, b.position.x);
};

}  // namespace

std::vector<Corner> keepApart(std::vector<Corner> corners, double min_spacing) {
  if (min_spacing <= 0.0) return corners;
  std::sort(corners.begin(), corners.end(), isStronger);
  // Positions that are kept, by the cell of a grid. Those too near to a corner lie in its cell or in a neighbour of it.
  const double side = std::max(min_spacing, 1.0);  // px
  std::map<std::pair<int, int>, std::vector<cv::Point2f>> cells;
  const auto isFree = [&](const cv::Point2f& position, int column, int row) {
    for (int y = row - 1; y <= row + 1; ++y)
      for (int x = column - 1; x <= column + 1; ++x)
        if (const auto cell = cells.find({x, y}); cell != cells.end())
          for (const cv::Point2f& kept : cell->second)
            if (std::hypot(kept.x - position.x, kept.y - position.y) < min_spacing) return false;
    return true;
  };
  std::vector<Corner> kept;
  for (const Corner& corner : corners) {
    const int column = cvFloor(corner.position.x / side), row = cvFloor(corner.position.y / side);
    if (!isFree(corner.position, column, row)) continue;
    cells[{column, row}].push_back(corner.position);
    kept.push_back(corner);
  }
  return kept;
}

std::vector<Corner> spreadOverBuckets(const std::vector<Corner>& corners, cv::Size image_size, int bucket_size,
                                      int max_count) {
  const int columns = (image_size.width + bucket_size - 1) / bucket_size;
  const int rows = (image_size.height + bucket_size - 1) / bucket_size;
  std::vector<std::vector<Corner>> buckets(static_cast<std::size_t>(columns) * rows);
  for (const Corner& corner : corners) {
    const int column = std::clamp(static_cast<int>(corner.position.x) / bucket_size, 0, columns - 1);
    const int row = std::clamp(static_cast<int>(corner.position.y) / bucket_size, 0, rows - 1);
    buckets[static_cast<std::size_t>(row) * columns + column].push_back(corner);
  }
  for (std::vector<Corner>& bucket : buckets) std::sort(bucket.begin(), bucket.end(), isStronger);

  // Serve every bucket's strongest corner, then every second strongest, …; the last round goes to the strongest of it.
  const std::size_t wanted = std::min(static_cast<std::size_t>(max_count), corners.size());
  std::vector<Corner> kept, served;
  for (std::size_t round = 0; kept.size() < wanted; ++round) {
    served.clear();
    for (const std::vector<Corner>& bucket : buckets)
      if (round < bucket.size()) served.push_back(bucket[round]);
    const std::size_t room = wanted - kept.size();
    if (served.size() > room) {
      std::sort(served.begin(), served.end(), isStronger);
      served.resize(room);
    }
    kept.insert(kept.end(), served.begin(), served.end());
  }
  return kept;
}

void FeatureDetectorOptions::check() const {
  if (type == DetectorType::kSift && !SDVO_HAVE_SIFT)
    throw std::invalid_argument("type 'sift' is not in this OpenCV (" CV_VERSION
                                "): OpenCV 4.4 and later have it in features2d");
}

FeatureDetector::FeatureDetector(const FeatureDetectorOptions& options) : options_(checked(options)) {
  if (options_.mask.empty()) return;
  try {
    mask_ = readMask(options_.mask);
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(std::string("mask: ") + e.what());
  }
}

std::vector<Corner> FeatureDetector::detect(const cv::Mat& image, int border, const cv::Mat& mask) const {
  CV_Assert(image.type() == CV_8UC1);
  const cv::Rect inner(border, border, image.cols - 2 * border, image.rows - 2 * border);
  if (inner.width < kSmallestSide || inner.height < kSmallestSide) return {};
  const std::size_t wanted = static_cast<std::size_t>(options_.max_features);
  const cv::Mat& valid = mask.empty() ? mask_ : mask;
  const auto find = [&](double contrast) {
    std::vector<Corner> corners = detectAll(image(inner), options_, std::max(cvRound(contrast), 1));
    for (Corner& corner : corners) corner.position += cv::Point2f(inner.tl());
    if (!valid.empty()) removeMasked(valid, image.size(), corners);
    return corners;
  };
  // If they are too few, the contrast is halved, at most twice: at 2.25 sigma noise alone has a corner in 300 px, at 1
  // sigma in 20.
  const bool has_limit = options_.type == DetectorType::kFast || options_.type == DetectorType::kOrb;
  const int halvings = has_limit ? 2 : 0;
  double contrast = options_.min_contrast * noiseOf(image(inner));
  std::vector<Corner> corners = find(contrast);
  for (int i = 0; i < halvings && corners.size() < wanted; ++i) corners = find(contrast *= 0.5);
  corners = keepApart(std::move(corners), options_.min_spacing);
  corners = spreadOverBuckets(corners, image.size(), options_.bucket_size, options_.max_features);
  if (options_.subpixel) refine(image, options_, corners);
  return corners;
}

}  // namespace sdvo
