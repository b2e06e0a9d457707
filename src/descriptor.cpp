#include "stereo_descriptor_vo/descriptor.hpp"

#include "stereo_descriptor_vo/freak.hpp"

namespace sdvo {
namespace {

/// Orientation in rad in [0, 2 pi), by FREAK's own measure, which serves every base descriptor; upright (-1) where the
/// neighbourhood leaves the image.
void orient(const cv::Mat& image, std::vector<ViewKeypoint>& keypoints) {
  const Freak freak(image);
  for (ViewKeypoint& k : keypoints) {
    const FreakKeypoint keypoint{k.u, k.v, k.size, -1.f};
    if (Freak::fits(keypoint, image.size())) k.angle = freak.orientation(keypoint);
  }
}

}  // namespace

void DescriptorOptions::describe(OptionList& list) {
  list.add("type", type, baseDescriptorNames(), "base descriptor");
  list.add("layout", layout, {"left", "left+right"}, "one view, or the left half followed by the right half");
  list.add("oriented", oriented, "turn the pattern to the left view's orientation (both halves by the same angle)");
}

StereoDescriptor::StereoDescriptor(const DescriptorOptions& options)
    : options_(checked(options)), base_(makeBaseDescriptor(options_.type)) {}

DescribedKeypoints StereoDescriptor::describe(const cv::Mat& left, const cv::Mat& right,
                                              const std::vector<StereoKeypoint>& keypoints) const {
  std::vector<ViewKeypoint> in_left, in_right;
  for (const StereoKeypoint& k : keypoints) {
    in_left.push_back({k.u_left, k.v_left, k.size, -1.f});
    in_right.push_back({k.u_right, k.v_right, k.size, -1.f});
  }
  if (options_.oriented) {
    orient(left, in_left);
    for (std::size_t i = 0; i < keypoints.size(); ++i) in_right[i].angle = in_left[i].angle;
  }
  const ViewDescriptors left_half = base_->describe(left, in_left);
  // Described in the right view even where only the left row is wanted: a feature set does not depend on the layout, and
  // layouts can be compared on the same features.
  const ViewDescriptors right_half = base_->describe(right, in_right);

  DescribedKeypoints described;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    if (!left_half.valid[i] || !right_half.valid[i]) continue;
    described.index.push_back(static_cast<int>(i));
    described.angle.push_back(in_left[i].angle);
  }
  const bool both = options_.layout == "left+right";
  const int bytes = base_->bytes(), count = static_cast<int>(described.index.size());
  described.rows.create(count, (both ? 2 : 1) * bytes, CV_8U);
  for (int row = 0; row < count; ++row) {
    const int i = described.index[row];
    left_half.rows.row(i).copyTo(described.rows.row(row).colRange(0, bytes));
    if (both) right_half.rows.row(i).copyTo(described.rows.row(row).colRange(bytes, 2 * bytes));
  }
  return described;
}

}  // namespace sdvo
