#include "stereo_descriptor_vo/common/stereo_features.hpp"

#include <cmath>
#include <stdexcept>

namespace sdvo {
namespace {

cv::Mat selectRows(const cv::Mat& matrix, const std::vector<int>& rows) {
  cv::Mat selected(static_cast<int>(rows.size()), matrix.cols, matrix.type());
  for (std::size_t k = 0; k < rows.size(); ++k) matrix.row(rows[k]).copyTo(selected.row(static_cast<int>(k)));
  return selected;
}

[[noreturn]] void refuse(const std::string& why) {
  throw std::invalid_argument("stereo features: " + why);
}

}  // namespace

bool DescriptorKind::operator==(const DescriptorKind& other) const {
  return descriptor == other.descriptor && layout == other.layout && element_type == other.element_type &&
         bytes == other.bytes;
}

std::string toString(const DescriptorKind& kind) {
  return kind.descriptor + " (" + nameOf(kind.layout) + ", " + std::to_string(kind.bytes) + " bytes of " +
         nameOf(kind.element_type) + ")";
}

void StereoFeatures::reserve(int count) {
  forEachArray([&](auto array, auto) { (this->*array).reserve(static_cast<std::size_t>(count)); });
}

void StereoFeatures::append(const StereoFeature& feature) {
  forEachArray([&](auto array, auto number) { (this->*array).push_back(feature.*number); });
}

StereoFeatures StereoFeatures::select(const std::vector<int>& indices) const {
  StereoFeatures selected = *this;
  forEachArray([&](auto array, auto) {
    (selected.*array).clear();
    for (const int i : indices) (selected.*array).push_back((this->*array)[static_cast<std::size_t>(i)]);
  });
  selected.descriptors = selectRows(descriptors, indices);
  if (hasPatches()) selected.patches = selectRows(patches, indices);
  return selected;
}

StereoFeatures StereoFeatures::seenBy(const StereoCamera& other) const {
  StereoFeatures seen = *this;
  seen.camera = other;
  const double x = other.fx / camera.fx, y = other.fy / camera.fy, depth = x * other.baseline / camera.baseline;
  for (std::size_t i = 0; i < u.size(); ++i) {
    seen.u[i] = static_cast<float>(other.cx + x * (u[i] - camera.cx));
    seen.v[i] = static_cast<float>(other.cy + y * (v[i] - camera.cy));
    seen.disparity[i] = static_cast<float>(depth * disparity[i]);
    seen.dv[i] = static_cast<float>(y * dv[i]);
    seen.size[i] = static_cast<float>(x * size[i]);
  }
  return seen;
}

void StereoFeatures::check() const {
  camera.check();
  if (const std::string fault = faultOfArrays(*this, camera.width, camera.height); !fault.empty()) refuse(fault);
  const auto requireRows = [this](const cv::Mat& matrix, const std::string& name) {
    if (matrix.rows != count())
      refuse(name + " (rows) has " + std::to_string(matrix.rows) + " elements, u has " + std::to_string(count()));
  };
  requireRows(descriptors, "descriptors");
  const int bytes = element_type == ElementType::kFloat32 ? 4 : 1;
  if (count() > 0 && (descriptors.type() != CV_8U || descriptors.cols % bytes != 0))
    refuse("descriptors are not rows of whole elements: " + toString(kind()));
  constexpr double kOtherPair = 1.0;  // s (chosen): images further apart are of two pairs
  if (!(std::abs(right_delay) <= kOtherPair)) refuse("right_delay is not a time of at most 1 s");
  if (!patch_layout.isUsable()) refuse("the patches' side must not be negative, and their spacing positive");
  if (!hasPatches()) return;
  requireRows(patches, "patches");
  if (count() > 0 && (patches.type() != CV_8U || patches.cols != patch_layout.bytes()))
    refuse("patches of " + std::to_string(patch_layout.side) + "x" + std::to_string(patch_layout.side) +
           " samples need rows of " + std::to_string(patch_layout.bytes()) + " bytes");
}

}  // namespace sdvo
