#include "stereo_descriptor_vo/common/stereo_camera.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <tuple>

#include "text.hpp"

namespace sdvo {

void StereoCamera::check() const {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument("stereo camera: " + what); };
  const auto isPositive = [](double value) { return std::isfinite(value) && value > 0.0; };
  if (width <= 0 || height <= 0)
    refuse("image size " + std::to_string(width) + "x" + std::to_string(height) + " is empty");
  if (!isPositive(fx)) refuse(text(6, "fx = ", fx, " px must be positive (uncalibrated?)"));
  if (!isPositive(fy)) refuse(text(6, "fy = ", fy, " px must be positive (uncalibrated?)"));
  if (!std::isfinite(cx) || !std::isfinite(cy)) refuse("the principal point is not finite");
  if (!isPositive(baseline))
    refuse(text(6, "baseline = ", baseline, " m must be positive (are left and right swapped?)"));
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

bool StereoCamera::isLike(const StereoCamera& other) const {
  constexpr double kShare = 0.05;
  const auto near = [](double a, double b, double whole) { return std::abs(a - b) <= kShare * whole; };
  return width == other.width && height == other.height && near(fx, other.fx, fx) && near(fy, other.fy, fy) &&
         near(cx, other.cx, fx) && near(cy, other.cy, fy) && near(baseline, other.baseline, baseline);
}

bool StereoCamera::operator==(const StereoCamera& o) const {
  const auto tie = [](const StereoCamera& c) {
    return std::tie(c.fx, c.fy, c.cx, c.cy, c.baseline, c.width, c.height);
  };
  return tie(*this) == tie(o);
}

}  // namespace sdvo
