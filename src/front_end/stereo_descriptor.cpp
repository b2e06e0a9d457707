#include "stereo_descriptor.hpp"

#include <algorithm>
#include <cmath>

#include "freak.hpp"
#include "image_copies.hpp"
#include "integral_image.hpp"

namespace sdvo {
namespace {

/// Orientation in rad in [0, 2 pi), by FREAK's own measure, which serves every base descriptor; upright (-1) where the
/// neighbourhood leaves the image.
void orient(const cv::Mat& image, std::vector<ViewKeypoint>& keypoints) {
  const Freak freak(image);
  for (ViewKeypoint& keypoint : keypoints)
    if (Freak::fits(keypoint, image.size())) keypoint.angle = freak.orientation(keypoint);
}

/// px by which patterns extend beyond the images at most; both images have this `size`.
int overhang(const BaseDescriptor& base, cv::Size size, const std::vector<StereoKeypoint>& keypoints) {
  const float last_column = static_cast<float>(size.width - 1), last_row = static_cast<float>(size.height - 1);
  double furthest = 0.0;
  for (const StereoKeypoint& k : keypoints) {
    const float to_border = std::min({k.u_left, k.u_right, last_column - k.u_left, last_column - k.u_right, k.v_left,
                                      k.v_right, last_row - k.v_left, last_row - k.v_right});
    furthest = std::max(furthest, base.reach(k.size) - to_border);
  }
  return static_cast<int>(std::ceil(furthest)) + 1;
}

}  // namespace

void DescriptorOptions::describe(OptionList& list) {
  list.add("type", type, "base descriptor; freak is this package's own (box filters, own bit pairs), not OpenCV's");
  list.add("layout", layout, "one view, or the left half followed by the right half");
  list.add("oriented", oriented, "turn the pattern to the left view's orientation (both halves by the same angle)");
  list.add(
      "extend_border", extend_border,
      "describe also what is too near to an image border for its size, if a size of 5 px fits: the image then goes on "
      "as its outermost pixels");
}

void DescriptorOptions::check() const {
  makeBaseDescriptor(type);
}

StereoDescriptor::StereoDescriptor(const DescriptorOptions& options)
    : options_(checked(options)), base_(makeBaseDescriptor(options_.type)) {}

double StereoDescriptor::reach(double size) const {
  return base_->reach(options_.extend_border ? std::min(size, DescriptorOptions::kInsideSize) : size);
}

double StereoDescriptor::largestSize(cv::Size image) const {
  return 0.5 * std::min(image.width, image.height) / base_->reach(1.0);  // the reach is proportional to the size
}

DescribedKeypoints StereoDescriptor::describe(const cv::Mat& left_image, const cv::Mat& right_image,
                                              const std::vector<StereoKeypoint>& keypoints) const {
  cv::Mat left = left_image, right = right_image;
  float shift = 0.f;
  if (options_.extend_border && !keypoints.empty()) {
    const int margin = overhang(*base_, left_image.size(), keypoints);
    cv::Mat larger_left, larger_right;
    addMargin(left_image, margin, larger_left);
    addMargin(right_image, margin, larger_right);
    left = larger_left, right = larger_right;
    shift = static_cast<float>(margin);
  }
  std::vector<ViewKeypoint> in_left, in_right;
  in_left.reserve(keypoints.size()), in_right.reserve(keypoints.size());
  for (const StereoKeypoint& k : keypoints) {
    in_left.push_back({k.u_left + shift, k.v_left + shift, k.size, -1.f});
    in_right.push_back({k.u_right + shift, k.v_right + shift, k.size, -1.f});
  }
  if (options_.oriented) {
    orient(left, in_left);
    for (std::size_t i = 0; i < keypoints.size(); ++i) in_right[i].angle = in_left[i].angle;
  }
  const ViewDescriptors left_half = base_->describe(left, in_left);
  // Described in the right view even where only the left row is wanted: a feature set does not depend on the layout,
  // and layouts can be compared on the same features.
  const ViewDescriptors right_half = base_->describe(right, in_right);

  DescribedKeypoints described;
  described.index.reserve(keypoints.size()), described.angle.reserve(keypoints.size());
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    if (!left_half.valid[i] || !right_half.valid[i]) continue;
    const StereoKeypoint& k = keypoints[i];
    if (options_.extend_border && (!liesInside(k.u_left, k.v_left, reach(k.size), left_image.size()) ||
                                   !liesInside(k.u_right, k.v_right, reach(k.size), right_image.size())))
      continue;
    described.index.push_back(static_cast<int>(i));
    described.angle.push_back(in_left[i].angle);
  }
  const bool both = options_.layout == DescriptorLayout::kLeftAndRight;
  const int bytes = base_->bytes(), count = static_cast<int>(described.index.size());
  described.rows.create(count, (both ? 2 : 1) * bytes, CV_8U);
  for (int row = 0; row < count; ++row) {
    const int i = described.index[row];
    std::uint8_t* rest = std::copy_n(left_half.rows.ptr(i), bytes, described.rows.ptr(row));
    if (both) std::copy_n(right_half.rows.ptr(i), bytes, rest);
  }
  return described;
}

}  // namespace sdvo
