#include "stereo_descriptor_vo/front_end/depth_scale.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace sdvo {

void DepthScaleOptions::check() const {
  if (min_size > max_size) throw std::invalid_argument("min_size exceeds max_size, no size is left");
}

DepthScale::DepthScale(const DepthScaleOptions& options) : options_(checked(options)) {}

double DepthScale::size(double disparity) const {
  if (!options_.scale_normalisation) return options_.constant_size;
  const double size = options_.slope * std::pow(disparity, options_.exponent) + options_.offset;
  return std::clamp(size, options_.min_size, options_.max_size);
}

}  // namespace sdvo
