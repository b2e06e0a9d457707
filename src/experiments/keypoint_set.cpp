#include "keypoint_set.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

namespace sdvo {
namespace {

bool fits(double u, double v, double reach, const StereoCamera& camera) {
  return u - reach >= -0.5 && v - reach >= -0.5 && u + reach <= camera.width - 0.5 && v + reach <= camera.height - 0.5;
}

}  // namespace

KeypointSet findKeypoints(const KittiSequence& sequence, int i, const FeatureDetectorOptions& detector,
                          const StereoMatcherOptions& stereo) {
  KeypointSet set;
  set.stamp = sequence.stamp(i);
  set.camera = sequence.camera();
  set.images = sequence.load(i);
  const std::vector<Corner> corners = FeatureDetector(detector).detect(set.images.left);
  std::vector<cv::Point2f> positions;
  for (const Corner& corner : corners) positions.push_back(corner.position);
  for (const StereoMatch& match : StereoMatcher(stereo).match(set.images.left, set.images.right, positions))
    set.corners.push_back({corners[static_cast<std::size_t>(match.left_index)], match});
  return set;
}

double measureReachPerSize(const std::string& descriptor) {
  constexpr int kSide = 601;
  constexpr float kSize = 20.f, kCentre = kSide / 2;
  const cv::Mat blank = cv::Mat::zeros(kSide, kSide, CV_8U);
  std::vector<ViewKeypoint> keypoints;
  for (int u = 0; u <= kSide / 2; ++u) keypoints.push_back({static_cast<float>(u), kCentre, kSize, -1.f});
  const ViewDescriptors described = makeBaseDescriptor(descriptor)->describe(blank, keypoints);
  const auto first = std::find(described.valid.begin(), described.valid.end(), 1);
  if (first == described.valid.end())
    throw std::runtime_error("descriptor " + descriptor + " reaches further than 300 px");
  // Half a pixel belongs to the border pixel itself.
  return (static_cast<double>(first - described.valid.begin()) + 0.5) / kSize;
}

std::vector<DepthScale> bindingCurves(const std::vector<DepthScale>& curves, const DescriptorOptions& descriptor) {
  if (!descriptor.extend_border) return curves;
  DepthScaleOptions standard;
  standard.scale_normalisation = false;
  standard.constant_size = BaseDescriptor::kStandardSize;
  return {DepthScale(standard)};
}

std::vector<int> selectKeypoints(const KeypointSet& set, const std::vector<DepthScale>& curves, double reach_per_size,
                                 int bucket_size, int count) {
  std::map<std::pair<float, float>, int> index_at;  // corners that the refinement laid upon each other count once
  std::vector<Corner> candidates;
  for (std::size_t i = 0; i < set.corners.size(); ++i) {
    const auto& [corner, match] = set.corners[i];
    double size = 0.0;
    for (const DepthScale& curve : curves) size = std::max(size, curve.size(match.disparity));
    const double reach = reach_per_size * size;
    const cv::Point2f& p = corner.position;
    if (!fits(p.x, p.y, reach, set.camera) || !fits(p.x - match.disparity, p.y + match.dv, reach, set.camera)) continue;
    if (index_at.emplace(std::make_pair(p.x, p.y), static_cast<int>(i)).second) candidates.push_back(corner);
  }
  std::vector<int> chosen;
  const cv::Size size(set.camera.width, set.camera.height);
  for (const Corner& corner : spreadOverBuckets(std::move(candidates), size, bucket_size, count))
    chosen.push_back(index_at.at({corner.position.x, corner.position.y}));
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

StereoFeatures describeKeypoints(const KeypointSet& set, const std::vector<int>& chosen, const DepthScale& curve,
                                 const StereoDescriptor& descriptor) {
  StereoFeatures features;
  features.stamp = set.stamp;
  features.camera = set.camera;
  features.descriptor = descriptor.options().type;
  features.layout = descriptor.options().layout;
  features.element_type = descriptor.elementType();
  std::vector<StereoKeypoint> keypoints;
  for (const int i : chosen) {
    const auto& [corner, match] = set.corners[static_cast<std::size_t>(i)];
    const cv::Point2f& p = corner.position;
    const float size = static_cast<float>(curve.size(match.disparity));
    keypoints.push_back({p.x, p.y, p.x - match.disparity, p.y + match.dv, size});
    features.append({p.x, p.y, match.disparity, match.dv, size, -1.f, corner.response, 0.3f, 0});
  }
  const DescribedKeypoints described = descriptor.describe(set.images.left, set.images.right, keypoints);
  if (described.index.size() != chosen.size())
    throw std::runtime_error("descriptor " + features.descriptor + " left out " +
                             std::to_string(chosen.size() - described.index.size()) + " of " +
                             std::to_string(chosen.size()) + " key points that lie inside both images");
  features.angle = described.angle;
  features.descriptors = described.rows;
  return features;
}

StereoFeatures selectRows(const StereoFeatures& features, const std::vector<int>& rows, const std::string& layout) {
  StereoFeatures selected = features.select(rows);
  if (layout == "left" && features.layout == "left+right") {
    selected.layout = layout;
    selected.descriptors = selected.descriptors.colRange(0, selected.descriptors.cols / 2).clone();
  }
  return selected;
}

}  // namespace sdvo
