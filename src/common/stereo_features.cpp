#include "stereo_descriptor_vo/common/stereo_features.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace sdvo {

void StereoFeatures::check() const {
  camera.check();
  const std::size_t n = u.size();
  const auto requireLength = [n](std::size_t length, const char* name) {
    if (length != n)
      throw std::invalid_argument("stereo features: array " + std::string(name) + " has " + std::to_string(length) +
                                  " elements, u has " + std::to_string(n));
  };
  requireLength(v.size(), "v");
  requireLength(disparity.size(), "disparity");
  requireLength(dv.size(), "dv");
  requireLength(size.size(), "size");
  requireLength(angle.size(), "angle");
  requireLength(response.size(), "response");
  requireLength(sigma.size(), "sigma");
  requireLength(octave.size(), "octave");
  requireLength(static_cast<std::size_t>(descriptors.rows), "descriptors (rows)");

  const auto requireFinite = [](const std::vector<float>& values, const char* name) {
    if (!std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); }))
      throw std::invalid_argument("stereo features: array " + std::string(name) + " holds a number that is not finite");
  };
  requireFinite(u, "u");
  requireFinite(v, "v");
  requireFinite(disparity, "disparity");
  requireFinite(dv, "dv");
  requireFinite(size, "size");
  requireFinite(angle, "angle");
  requireFinite(response, "response");
  requireFinite(sigma, "sigma");
  const auto requirePositive = [](const std::vector<float>& values, const char* name) {
    if (!std::all_of(values.begin(), values.end(), [](float x) { return x > 0.f; }))
      throw std::invalid_argument("stereo features: array " + std::string(name) +
                                  " holds a number that is not positive");
  };
  requirePositive(disparity, "disparity");
  requirePositive(size, "size");
  requirePositive(sigma, "sigma");
}

}  // namespace sdvo
