#include "stereo_descriptor_vo/descriptor.hpp"

#include "stereo_descriptor_vo/freak.hpp"

namespace sdvo {

StereoDescriptor::StereoDescriptor(const DescriptorOptions& options) : options_(checked(options)) {}

DescribedKeypoints StereoDescriptor::describe(const cv::Mat& left, const cv::Mat& right,
                                              const std::vector<StereoKeypoint>& keypoints) const {
  const bool both = options_.layout == "left+right";
  const auto inLeft = [](const StereoKeypoint& k) { return FreakKeypoint{k.u_left, k.v_left, k.size, -1.f}; };
  const auto inRight = [](const StereoKeypoint& k) { return FreakKeypoint{k.u_right, k.v_right, k.size, -1.f}; };

  DescribedKeypoints described;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    // The right neighbourhood must fit even where only the left one is described: a feature set does not depend on
    // the layout, and layouts can be compared on the same features.
    if (Freak::fits(inLeft(keypoints[i]), left.size()) && Freak::fits(inRight(keypoints[i]), right.size()))
      described.index.push_back(static_cast<int>(i));
  }
  const int count = static_cast<int>(described.index.size());
  described.angle.assign(described.index.size(), -1.f);
  described.rows.create(count, (both ? 2 : 1) * Freak::kBytes, CV_8U);
  if (count == 0) return described;

  const Freak left_view(left);
  const Freak right_view(both ? right : left);
  for (int row = 0; row < count; ++row) {
    FreakKeypoint keypoint = inLeft(keypoints[described.index[row]]);
    if (options_.oriented) keypoint.angle = left_view.orientation(keypoint);
    left_view.describe(keypoint, described.rows.ptr(row));
    const float angle = keypoint.angle;
    if (both) {
      keypoint = inRight(keypoints[described.index[row]]);
      keypoint.angle = angle;
      right_view.describe(keypoint, described.rows.ptr(row) + Freak::kBytes);
    }
    constexpr float kPi = static_cast<float>(CV_PI);
    if (options_.oriented) described.angle[row] = angle > kPi ? angle - 2.f * kPi : angle;
  }
  return described;
}

}  // namespace sdvo
