#include "stereo_descriptor_vo/common/stereo_features.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace sdvo {
namespace {

int bytesOf(ElementType type) {
  return type == ElementType::kFloat32 ? 4 : 1;
}

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
  forEachArray([&](const char*, auto array, auto) { (this->*array).reserve(static_cast<std::size_t>(count)); });
}

void StereoFeatures::append(const StereoFeature& feature) {
  forEachArray([&](const char*, auto array, auto number) { (this->*array).push_back(feature.*number); });
}

StereoFeatures StereoFeatures::select(const std::vector<int>& indices) const {
  StereoFeatures selected;
  selected.stamp = stamp;
  selected.camera = camera;
  selected.right_delay = right_delay;
  selected.descriptor = descriptor;
  selected.layout = layout;
  selected.element_type = element_type;
  selected.report = report;
  forEachArray([&](const char*, auto array, auto) {
    for (const int i : indices) (selected.*array).push_back((this->*array)[static_cast<std::size_t>(i)]);
  });
  selected.descriptors = selectRows(descriptors, indices);
  selected.patch_layout = patch_layout;
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
  const std::size_t n = u.size();
  const auto requireLength = [n](std::size_t length, const std::string& name) {
    if (length != n)
      refuse("array " + name + " has " + std::to_string(length) + " elements, u has " + std::to_string(n));
  };
  forEachArray([&](const char* name, auto array, auto) { requireLength((this->*array).size(), name); });
  requireLength(static_cast<std::size_t>(descriptors.rows), "descriptors (rows)");
  if (n > 0 && (descriptors.type() != CV_8U || descriptors.cols % bytesOf(element_type) != 0))
    refuse("descriptors are not rows of whole elements: " + toString(kind()));
  constexpr double kOtherPair = 1.0;  // s (chosen): images further apart are of two pairs
  if (!(std::abs(right_delay) <= kOtherPair)) refuse("right_delay is not a time of at most 1 s");
  if (patch_layout.side < 0) refuse("the patches' side must not be negative");
  if (hasPatches()) {
    if (!(patch_layout.min_spacing > 0.f) || !(patch_layout.spacing_by_size >= 0.f) ||
        !std::isfinite(patch_layout.min_spacing) || !std::isfinite(patch_layout.spacing_by_size))
      refuse("the patches' spacing must be positive");
    requireLength(static_cast<std::size_t>(patches.rows), "patches (rows)");
    if (n > 0 && (patches.type() != CV_8U || patches.cols != patch_layout.bytes()))
      refuse("patches of " + std::to_string(patch_layout.side) + "x" + std::to_string(patch_layout.side) +
             " samples need rows of " + std::to_string(patch_layout.bytes()) + " bytes");
  }

  forEachArray([&](const char* name, auto array, auto) {
    const auto& values = this->*array;
    if (!std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); }))
      refuse("array " + std::string(name) + " holds a number that is not finite");
  });
  // Further outside of the image no point can be seen; squares of such numbers overflow.
  const double most = 2.0 * (camera.width + camera.height);
  for (const auto array :
       {&StereoFeatures::u, &StereoFeatures::v, &StereoFeatures::disparity, &StereoFeatures::dv, &StereoFeatures::size})
    if (const auto& values = this->*array;
        !std::all_of(values.begin(), values.end(), [most](float x) { return std::abs(x) <= most; }))
      refuse("an array of pixels (u, v, disparity, dv or size) holds a number beyond " + std::to_string(most) +
             " px, twice the image's width and height");
  const auto requirePositive = [](const std::vector<float>& values, const std::string& name) {
    if (!std::all_of(values.begin(), values.end(), [](float x) { return x > 0.f; }))
      refuse("array " + name + " holds a number that is not positive");
  };
  requirePositive(disparity, "disparity");
  requirePositive(size, "size");
}

}  // namespace sdvo
