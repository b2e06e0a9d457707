#include "depth_scale.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sdvo {
namespace {

struct OwnCurve {
  double slope, min_size, max_size;  ///< px
};

/// Chosen by `learn size-curve` on drives that are not reported: lab/docs/experiments.md, "The size curve of each
/// descriptor".
OwnCurve ownCurve(DescriptorType type) {
  constexpr double kLargest = 32.0;                            // px, of all: three octaves above FREAK's smallest
  constexpr double kStandard = BaseDescriptor::kStandardSize;  // the smallest that ORB and BRISK tell apart
  switch (type) {
    case DescriptorType::kFreak:
      return {0.72, 4.0, kLargest};
    case DescriptorType::kSift:
      return {0.2, 4.0, kLargest};
    case DescriptorType::kBrief:
      return {0.35, 4.0, kLargest};
    case DescriptorType::kBrisk:
      return {0.7, kStandard, kLargest};
    case DescriptorType::kOrb:
      return {0.5, kStandard, kLargest};
    case DescriptorType::kSurf:  // not in the OpenCV at hand
      return {0.72, kStandard, kStandard};
  }
  throw std::invalid_argument("there is no such base descriptor");
}

}  // namespace

DepthScaleOptions DepthScaleOptions::completedFor(DescriptorType type) const {
  const OwnCurve own = ownCurve(type);
  DepthScaleOptions completed = *this;
  if (slope == 0.0) completed.slope = own.slope;
  if (min_size == 0.0) completed.min_size = own.min_size;
  if (max_size == 0.0) completed.max_size = own.max_size;
  return completed;
}

DepthScale::DepthScale(const DepthScaleOptions& options) : options_(checked(options)) {
  constexpr double kSmallest = 2.0;  // px; no base descriptor has a finer field
  if (!options_.scale_normalisation) return;
  if (options_.slope == 0.0) throw std::invalid_argument("slope is 0, which no descriptor has completed");
  if (options_.min_size < kSmallest) throw std::invalid_argument("min_size is below 2 px");
  if (options_.min_size > options_.max_size) {
    const auto px = [](double value) { return std::to_string(static_cast<int>(std::lround(value))) + " px"; };
    throw std::invalid_argument("min_size of " + px(options_.min_size) + " exceeds max_size of " +
                                px(options_.max_size) + ", no size is left");
  }
}

double DepthScale::size(double disparity) const {
  if (!options_.scale_normalisation) return options_.constant_size;
  const double size = options_.slope * std::pow(disparity, options_.exponent) + options_.offset;
  return std::clamp(size, options_.min_size, options_.max_size);
}

}  // namespace sdvo
