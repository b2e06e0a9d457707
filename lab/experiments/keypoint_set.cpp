#include "keypoint_set.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include "../../src/front_end/fast_corners.hpp"
#include "../../src/front_end/integral_image.hpp"
#include "stereo_tracking.hpp"

namespace sdvo {
namespace {

std::vector<Corner> findCorners(const cv::Mat& image, const ExperimentOptions& options) {
  const FeatureDetectorOptions& detector = options.stereo_features.detector;
  if (options.noise <= 0.0 || detector.type != DetectorType::kFast) return FeatureDetector(detector).detect(image);
  std::vector<Corner> corners;
  for (const cv::KeyPoint& keypoint : findFastCorners(image, cvRound(options.noise * detector.min_contrast)))
    corners.push_back({keypoint.pt, keypoint.response});
  corners = keepApart(std::move(corners), detector.min_spacing);
  corners = spreadOverBuckets(corners, image.size(), detector.bucket_size, detector.max_features);
  if (detector.subpixel)
    for (Corner& corner : corners) corner.position += cornerPeak(image, cv::Point(corner.position));
  return corners;
}

}  // namespace

KeypointSet findKeypoints(const KittiSequence& sequence, int i, const ExperimentOptions& options) {
  KeypointSet set;
  set.stamp = sequence.stamp(i);
  set.camera = sequence.camera();
  set.images = sequence.load(i);
  const std::vector<Corner> corners = findCorners(set.images.left, options);
  std::vector<cv::Point2f> positions;
  for (const Corner& corner : corners) positions.push_back(corner.position);
  const StereoMatcherOptions& stereo = options.stereo_features.stereo;
  const auto& [left, right] = set.images;
  for (const StereoMatch& match : options.tracks ? trackToRight(left, right, positions, stereo)
                                                 : StereoMatcher(stereo).match(left, right, positions))
    set.corners.push_back({corners[static_cast<std::size_t>(match.left_index)], match});
  return set;
}

std::vector<int> selectKeypoints(const KeypointSet& set, const std::vector<DepthScale>& curves, const Reach& reach,
                                 int bucket_size, int count) {
  std::map<std::pair<float, float>, int> index_at;  // corners that the refinement laid upon each other count once
  std::vector<Corner> candidates;
  const cv::Size image(set.camera.width, set.camera.height);
  for (std::size_t i = 0; i < set.corners.size(); ++i) {
    const auto& [corner, match] = set.corners[i];
    float size = 0.f;
    for (const DepthScale& curve : curves) size = std::max(size, static_cast<float>(curve.size(match.disparity)));
    const cv::Point2f& p = corner.position;
    if (!liesInside(p.x, p.y, reach(size), image) ||
        !liesInside(p.x - match.disparity, p.y + match.dv, reach(size), image))
      continue;
    if (index_at.emplace(std::make_pair(p.x, p.y), static_cast<int>(i)).second) candidates.push_back(corner);
  }
  std::vector<int> chosen;
  for (const Corner& corner : spreadOverBuckets(std::move(candidates), image, bucket_size, count))
    chosen.push_back(index_at.at({corner.position.x, corner.position.y}));
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

std::vector<StereoFeatures> describeKeypoints(const KeypointSet& set, const std::vector<int>& chosen,
                                              const std::vector<DepthScale>& curves,
                                              const StereoDescriptor& descriptor) {
  std::vector<StereoKeypoint> keypoints;
  for (const DepthScale& curve : curves)
    for (const int i : chosen) {
      const auto& [corner, match] = set.corners[static_cast<std::size_t>(i)];
      const cv::Point2f& p = corner.position;
      keypoints.push_back(
          {p.x, p.y, p.x - match.disparity, p.y + match.dv, static_cast<float>(curve.size(match.disparity))});
    }
  const DescribedKeypoints described = descriptor.describe(set.images.left, set.images.right, keypoints);
  if (described.index.size() != keypoints.size())
    throw std::runtime_error("descriptor " + nameOf(descriptor.options().type) + " left out " +
                             std::to_string(keypoints.size() - described.index.size()) + " of " +
                             std::to_string(keypoints.size()) + " key points that lie inside both images");

  std::vector<StereoFeatures> of_curve;
  for (std::size_t c = 0, row = 0; c < curves.size(); ++c) {
    StereoFeatures& features = of_curve.emplace_back();
    features.stamp = set.stamp;
    features.camera = set.camera;
    features.descriptor = nameOf(descriptor.options().type);
    features.layout = descriptor.options().layout;
    features.element_type = descriptor.elementType();
    features.descriptors =
        described.rows.rowRange(static_cast<int>(row), static_cast<int>(row + chosen.size())).clone();
    for (const int i : chosen) {
      const auto& [corner, match] = set.corners[static_cast<std::size_t>(i)];
      features.append({corner.position.x, corner.position.y, match.disparity, match.dv, keypoints[row].size,
                       described.angle[row], corner.response});
      ++row;
    }
  }
  return of_curve;
}

StereoFeatures cutPatches(const KeypointSet& set, const std::vector<int>& chosen, const DepthScale& curve,
                          const PatchLayout& layout) {
  StereoFeatures features;
  features.stamp = set.stamp;
  features.camera = set.camera;
  features.patch_layout = layout;
  features.patches.create(static_cast<int>(chosen.size()), layout.bytes(), CV_8U);
  const PatchCutter cutter(layout, set.images.left);
  for (const int i : chosen) {
    const auto& [corner, match] = set.corners[static_cast<std::size_t>(i)];
    const cv::Point2f& p = corner.position;
    const float size = static_cast<float>(curve.size(match.disparity));
    cutter.cut(p.x, p.y, size, features.patches.ptr(features.count()));
    features.append({p.x, p.y, match.disparity, match.dv, size, -1.f, corner.response});
  }
  return features;
}

StereoFeatures selectRows(const StereoFeatures& features, const std::vector<int>& rows, DescriptorLayout layout) {
  StereoFeatures selected = features.select(rows);
  if (layout == DescriptorLayout::kLeft && features.layout == DescriptorLayout::kLeftAndRight) {
    selected.layout = layout;
    selected.descriptors = selected.descriptors.colRange(0, selected.descriptors.cols / 2).clone();
  }
  return selected;
}

}  // namespace sdvo
