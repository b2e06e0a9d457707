#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "../common/kernel.hpp"
#include "../common/stopwatch.hpp"
#include "../common/text.hpp"
#include "depth_scale.hpp"
#include "exposure_balance.hpp"
#include "feature_detector.hpp"
#include "image_noise.hpp"
#include "patch_cutter.hpp"
#include "repeated_texture.hpp"
#include "rig_monitor.hpp"
#include "stereo_descriptor.hpp"
#include "stereo_matcher.hpp"

namespace sdvo {
namespace {

void checkImage(const cv::Mat& image, const char* side, const StereoCamera& camera) {
  if (image.type() == CV_8UC1 && image.cols == camera.width && image.rows == camera.height) return;
  throw std::invalid_argument(text(0, side, " image is ", image.cols, "x", image.rows, " with ", image.channels(),
                                   " channel(s) of ", image.elemSize1(), " byte(s); the camera model needs ",
                                   camera.width, "x", camera.height, " with 1 channel of 1 byte"));
}

/// Sums of the grey levels, without the first one, and of the absolute horizontal gradients.
struct MeasureRow {
  static SDVO_IN_KERNEL void run(const std::uint8_t* row, int columns, int* sum, int* gradient) {
    int greys = 0, gradients = 0;
    for (int x = 1; x < columns; ++x) {
      greys += row[x];
      gradients += std::abs(row[x] - row[x - 1]);
    }
    *sum = greys, *gradient = gradients;
  }
};

/// Mean grey level and mean absolute horizontal gradient of every fourth row: precise enough to recognise darkness and
/// blur.
void measureImage(const cv::Mat& image, double& mean_intensity, double& sharpness) {
  constexpr int kRowStep = 4;
  std::int64_t sum = 0, gradient = 0, pixels = 0;
  for (int y = 0; y < image.rows; y += kRowStep) {
    const std::uint8_t* row = image.ptr(y);
    int sum_of_row, gradient_of_row;
    runKernel<MeasureRow>(row, image.cols, &sum_of_row, &gradient_of_row);
    sum += sum_of_row;
    gradient += gradient_of_row;
    pixels += image.cols - 1;
  }
  mean_intensity = static_cast<double>(sum) / static_cast<double>(std::max<std::int64_t>(pixels, 1));
  sharpness = static_cast<double>(gradient) / static_cast<double>(std::max<std::int64_t>(pixels, 1));
}

/// Why there are no features, or what is wrong with the rig.
std::string wordsOn(const StereoFeatures& features, const std::string& diagnosis, bool is_too_small) {
  if (!diagnosis.empty()) return diagnosis;
  if (is_too_small)
    return "every feature is too close to an image border for its descriptor: the image is too small for its size";
  if (features.report.detected == 0)
    return "no corners: the left image has no texture (dark, covered, masked or out of focus?)";
  if (features.report.stereo_matched == 0)
    return "no stereo matches: either different scenes or moments, or rows far apart, or a scene too near";
  return features.count() == 0 ? "every feature is too close to an image border for its descriptor" : "";
}

cv::Mat cutPatches(const cv::Mat& image, const StereoFeatures& features) {
  const PatchCutter cutter(features.patch_layout, image);
  cv::Mat patches(features.count(), features.patch_layout.bytes(), CV_8U);
  for (int i = 0; i < features.count(); ++i) cutter.cut(features.u[i], features.v[i], features.size[i], patches.ptr(i));
  return patches;
}

}  // namespace

void FeatureExtractorOptions::check() const {
  try {
    DepthScale{sizeCurve()};
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(std::string("size_curve/") + e.what());
  }
}

class FeatureExtractor::Impl {
 public:
  explicit Impl(const FeatureExtractorOptions& options);

  StereoFeatures extract(const StereoCamera& camera, const cv::Mat& left, const cv::Mat& right, std::int64_t stamp,
                         const cv::Mat& mask, const ExtractionReport& before) const;
  DepthScaleOptions sizeCurve(cv::Size image) const;
  const FeatureExtractorOptions& options() const { return options_; }

 private:
  /// Stereo matches of a rig whose rows differ by a line.
  std::vector<StereoMatch> matchAlong(const RowLine& rows, const cv::Mat& left, const cv::Mat& right,
                                      const std::vector<cv::Point2f>& positions) const;
  /// Appends what both views describe of the matched corners.
  void describe(const cv::Mat& left, const cv::Mat& right, const std::vector<Corner>& corners,
                const std::vector<StereoMatch>& matches, StereoFeatures& features) const;

  FeatureExtractorOptions options_;
  FeatureDetector detector_;
  StereoMatcher stereo_matcher_;
  RigMonitor rig_monitor_;
  DepthScale depth_scale_;
  StereoDescriptor descriptor_;
};

FeatureExtractor::FeatureExtractor(const FeatureExtractorOptions& options) : impl_(std::make_unique<Impl>(options)) {}
FeatureExtractor::~FeatureExtractor() = default;

StereoFeatures FeatureExtractor::extract(const StereoCamera& camera, const cv::Mat& left, const cv::Mat& right,
                                         std::int64_t stamp, const cv::Mat& mask,
                                         const ExtractionReport& before) const {
  return impl_->extract(camera, left, right, stamp, mask, before);
}
DepthScaleOptions FeatureExtractor::sizeCurve(cv::Size image) const {
  return impl_->sizeCurve(image);
}
const FeatureExtractorOptions& FeatureExtractor::options() const {
  return impl_->options();
}

FeatureExtractor::Impl::Impl(const FeatureExtractorOptions& options)
    : options_(checked(options)),
      detector_(options.detector),
      stereo_matcher_(options.stereo),
      rig_monitor_(options.rig_monitor, options.stereo.max_epipolar_residual, options.stereo.epipolar.max_disparity),
      depth_scale_(options.sizeCurve()),
      descriptor_(options.descriptor) {}

DepthScaleOptions FeatureExtractor::Impl::sizeCurve(cv::Size image) const {
  DepthScaleOptions curve = options_.sizeCurve();
  const double largest = descriptor_.largestSize(image);
  for (double* size : {&curve.min_size, &curve.max_size, &curve.constant_size}) *size = std::min(*size, largest);
  return curve;
}

void FeatureExtractor::Impl::describe(const cv::Mat& left, const cv::Mat& right, const std::vector<Corner>& corners,
                                      const std::vector<StereoMatch>& matches, StereoFeatures& features) const {
  // Size from depth, as far as the image has room for it, then the descriptor of both views at that size.
  const double largest = descriptor_.largestSize(left.size());
  std::vector<StereoKeypoint> keypoints;
  keypoints.reserve(matches.size());
  for (const StereoMatch& match : matches) {
    const cv::Point2f& position = corners[match.left_index].position;
    keypoints.push_back({position.x, position.y, position.x - match.disparity, position.y + match.dv,
                         static_cast<float>(std::min(depth_scale_.size(match.disparity), largest))});
  }
  const DescribedKeypoints described = descriptor_.describe(left, right, keypoints);
  features.reserve(static_cast<int>(described.index.size()));
  for (std::size_t row = 0; row < described.index.size(); ++row) {
    const int i = described.index[row];
    const Corner& corner = corners[matches[i].left_index];
    features.append({corner.position.x, corner.position.y, matches[i].disparity, matches[i].dv, keypoints[i].size,
                     described.angle[row], corner.response});
  }
  features.descriptors = described.rows;
}

std::vector<StereoMatch> FeatureExtractor::Impl::matchAlong(const RowLine& rows, const cv::Mat& left,
                                                            const cv::Mat& right,
                                                            const std::vector<cv::Point2f>& positions) const {
  cv::Mat sheared;
  const cv::Matx23d there(1.0, 0.0, 0.0, rows.slope, 1.0, rows.at(0.0));
  cv::warpAffine(right, sheared, there, right.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  std::vector<StereoMatch> matches = stereo_matcher_.match(left, sheared, positions);
  for (StereoMatch& match : matches)
    match.dv += static_cast<float>(rows.at(positions[static_cast<std::size_t>(match.left_index)].x - match.disparity));
  return matches;
}

StereoFeatures FeatureExtractor::Impl::extract(const StereoCamera& camera, const cv::Mat& left, const cv::Mat& right,
                                               std::int64_t stamp, const cv::Mat& mask,
                                               const ExtractionReport& before) const {
  camera.check();
  checkImage(left, "left", camera);
  checkImage(right, "right", camera);

  StereoFeatures features;
  features.stamp = stamp;
  features.camera = camera;
  features.descriptor = nameOf(options_.descriptor.type);
  features.layout = options_.descriptor.layout;
  features.element_type = descriptor_.elementType();
  ExtractionReport& report = features.report;

  // Detect in the left image, where at least the smallest descriptor fits and nothing is masked.
  const int border = static_cast<int>(descriptor_.reach(depth_scale_.size(options_.stereo.min_disparity)));
  Stopwatch stopwatch;
  const std::vector<Corner> corners = detector_.detect(left, border, mask);
  report.detected = static_cast<int>(corners.size());
  measureImage(left, report.mean_intensity[0], report.sharpness[0]);
  report.noise = noiseOf(left);
  report.detect_time = stopwatch.lap();
  measureImage(right, report.mean_intensity[1], report.sharpness[1]);

  // Find each feature in the right image, in images that are equally exposed.
  cv::Mat searched_left = left, searched_right = right;
  balanceExposures(report.mean_intensity[0], report.mean_intensity[1], searched_left, searched_right);
  std::vector<cv::Point2f> positions;
  positions.reserve(corners.size());
  for (const Corner& corner : corners) positions.push_back(corner.position);
  std::vector<StereoMatch> matches = stereo_matcher_.match(searched_left, searched_right, positions);
  report.stereo_matched = static_cast<int>(matches.size());
  RigDiagnosis diagnosis;
  if (rig_monitor_.isSuspicious(report.detected, report.stereo_matched))
    diagnosis = rig_monitor_.diagnose(left, right, positions, report, before);
  constexpr double kKnock = 0.0175;  // rad: a degree; images that differ by more are not those of a rectified rig
  report.refused = diagnosis.refused;
  if (diagnosis.rows && diagnosis.rows->most() < kKnock * camera.fy) {
    matches = matchAlong(*diagnosis.rows, searched_left, searched_right, positions);
    report.stereo_matched = static_cast<int>(matches.size());
    report.refused = rig_monitor_.isSuspicious(report.detected, report.stereo_matched);
    report.along_rows = !report.refused;
  }
  if (diagnosis.too_near) {
    matches = stereo_matcher_.match(searched_left, searched_right, positions, left.cols);
    report.stereo_matched = static_cast<int>(matches.size());
  }
  // A refused rig matches wrong points.
  if (report.refused) matches.clear();
  const std::string repetition = removeRepeated(matches, camera, options_.stereo.epipolar.max_disparity);
  report.stereo_time = stopwatch.lap();

  describe(left, right, corners, matches, features);

  // A patch of the left view at that size, with which later pairs align the feature.
  features.patch_layout = options_.patch.layout();
  if (features.hasPatches()) features.patches = cutPatches(left, features);
  report.describe_time = stopwatch.lap();

  const bool is_too_small = 2 * border + FeatureDetector::kSmallestSide > std::min(left.rows, left.cols);
  report.status = wordsOn(features, diagnosis.words.empty() ? repetition : diagnosis.words, is_too_small);
  return features;
}

}  // namespace sdvo
