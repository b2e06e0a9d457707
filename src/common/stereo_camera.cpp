#include "stereo_descriptor_vo/common/stereo_camera.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <tuple>

namespace sdvo {

void StereoCamera::check() const {
  const auto require = [](bool holds, const std::string& what) {
    if (!holds) throw std::invalid_argument("stereo camera: " + what);
  };
  require(width > 0 && height > 0, "image size " + std::to_string(width) + "x" + std::to_string(height) + " is empty");
  require(std::isfinite(fx) && fx > 0.0, "fx = " + std::to_string(fx) + " px must be positive (uncalibrated?)");
  require(std::isfinite(fy) && fy > 0.0, "fy = " + std::to_string(fy) + " px must be positive (uncalibrated?)");
  require(std::isfinite(cx) && std::isfinite(cy), "the principal point is not finite");
  require(std::isfinite(baseline) && baseline > 0.0,
          "baseline = " + std::to_string(baseline) + " m must be positive (are left and right swapped?)");
}

Eigen::Matrix3d StereoCamera::projectionJacobian(const Eigen::Vector3d& point) const {
  const double iz = 1.0 / point.z();
  const double iz2 = iz * iz;
  Eigen::Matrix3d jacobian;
  jacobian << fx * iz, 0.0, -fx * point.x() * iz2,  //
      0.0, fy * iz, -fy * point.y() * iz2,          //
      fx * iz, 0.0, -fx * (point.x() - baseline) * iz2;
  return jacobian;
}

bool StereoCamera::operator==(const StereoCamera& o) const {
  const auto tie = [](const StereoCamera& c) {
    return std::tie(c.fx, c.fy, c.cx, c.cy, c.baseline, c.width, c.height);
  };
  return tie(*this) == tie(o);
}

}  // namespace sdvo
