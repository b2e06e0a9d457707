#include "pair_decoder.hpp"

#include <algorithm>
#include <cmath>

#include "conversions.hpp"

namespace sdvo {
namespace {

/// Whether two calibrations are one but for rounding.
bool agree(const StereoCamera& a, const StereoCamera& b) {
  constexpr double kPixels = 1e-3, kShare = 1e-5;
  const auto near = [](double x, double y, double tolerance) { return std::abs(x - y) <= tolerance; };
  return a.width == b.width && a.height == b.height && near(a.fx, b.fx, kPixels) && near(a.fy, b.fy, kPixels) &&
         near(a.cx, b.cx, kPixels) && near(a.cy, b.cy, kPixels) && near(a.baseline, b.baseline, kShare * a.baseline);
}

}  // namespace

DecodedPair PairDecoder::decode(const StereoPairMessages& pair) {
  const StereoCamera given = ros_conversions::toStereoCamera(*pair.left_info, *pair.right_info);
  bit_depth_ =
      std::max({bit_depth_, ros_conversions::bitDepth(*pair.left_image), ros_conversions::bitDepth(*pair.right_image)});
  return {camera_ && agree(*camera_, given) ? *camera_ : given, ros_conversions::toGrey(pair.left_image, bit_depth_),
          ros_conversions::toGrey(pair.right_image, bit_depth_)};
}

bool PairDecoder::accept(const StereoCamera& camera) {
  const bool changed = camera_ && *camera_ != camera;
  camera_ = camera;
  return changed;
}

}  // namespace sdvo
