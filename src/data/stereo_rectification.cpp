#include "stereo_rectification.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <stdexcept>

#include "../common/text.hpp"

namespace sdvo {
namespace {

/// Largest default field of view. At its edge (55 deg) a pixel covers cos²(55 deg), a third, of the angle of one in the
/// middle: a wider image would be mostly stretched border.
constexpr double kWidest = 110.0;  // deg

double focalLength(int width, double fov) {
  return 0.5 * width / std::tan(fov * M_PI / 360.0);
}

}  // namespace

void RawCamera::setLens(const std::string& model, std::vector<double> coefficients) {
  static const std::set<std::string> pinholes = {"plumb_bob", "rational_polynomial",
                                                 "radtan",    "radial-tangential",
                                                 "none",      ""},
                                     fisheyes = {"equidistant", "equi", "fisheye", "kannala_brandt", "kannala_brandt4"};
  is_equidistant = fisheyes.count(model) > 0;
  if (!is_equidistant && pinholes.count(model) == 0)
    throw std::invalid_argument("lens model '" + model +
                                "' is not supported: radial-tangential (radtan, plumb_bob), rational_polynomial and "
                                "equidistant (fisheye, kannala_brandt4) are");
  // Some drivers (T265) append zeros.
  while (is_equidistant && coefficients.size() > 4 && coefficients.back() == 0.0) coefficients.pop_back();
  if (coefficients.empty()) coefficients.assign(4, 0.0);
  const std::set<std::size_t> sizes =
      is_equidistant ? std::set<std::size_t>{4} : std::set<std::size_t>{4, 5, 8, 12, 14};
  if (sizes.count(coefficients.size()) == 0)
    throw std::invalid_argument("lens model '" + model + "' with " + std::to_string(coefficients.size()) +
                                " coefficients: " + (is_equidistant ? "4 are" : "4, 5, 8, 12 or 14 are") + " expected");
  D = std::move(coefficients);
}

StereoCamera withFieldOfView(StereoCamera camera, double fov) {
  camera.fx = camera.fy = focalLength(camera.width, fov);
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  return camera;
}

StereoRectification::StereoRectification(const RawCameras& raw, const std::array<cv::Matx33d, 2>& rotations,
                                         const StereoCamera& camera)
    : raw_(raw), rotations_(rotations), camera_(camera) {
  makeMaps();
}

StereoRectification::StereoRectification(const RawCameras& raw, const Eigen::Isometry3d& T_right_left, double fov)
    : raw_(raw) {
  const auto& [left, right] = raw_;
  if (left.size != right.size) throw std::invalid_argument("the cameras differ in image resolution");
  if (left.is_equidistant != right.is_equidistant) throw std::invalid_argument("the cameras differ in lens model");
  cv::Mat R, t, R_rect[2], P[2], Q;
  cv::eigen2cv(Eigen::Matrix3d(T_right_left.linear()), R);
  cv::eigen2cv(Eigen::Vector3d(T_right_left.translation()), t);
  if (left.is_equidistant)
    cv::fisheye::stereoRectify(left.K, left.D, right.K, right.D, left.size, R, t, R_rect[0], R_rect[1], P[0], P[1], Q,
                               cv::CALIB_ZERO_DISPARITY);  // equal to that of fisheye, which OpenCV 4.2 lacks
  else
    cv::stereoRectify(left.K, left.D, right.K, right.D, left.size, R, t, R_rect[0], R_rect[1], P[0], P[1], Q,
                      cv::CALIB_ZERO_DISPARITY, 0.0);
  for (std::size_t side : {0u, 1u}) rotations_[side] = R_rect[side];
  const cv::Matx34d p = P[1];
  camera_ = {p(0, 0), p(1, 1), p(0, 2), p(1, 2), -p(0, 3) / p(0, 0), left.size.width, left.size.height};
  if (!(camera_.baseline > 0.0))
    throw std::invalid_argument(text(3, "the second camera is ", -T_right_left.translation().x(),
                                     " m to the right of the first one and ", -T_right_left.translation().y(),
                                     " m below it: are the cameras swapped? One above the other: docs/cameras.md, 'A "
                                     "vertical pair'"));
  if (fov == 0.0 && camera_.fx < focalLength(camera_.width, kWidest)) fov = kWidest;
  if (fov > 0.0) camera_ = withFieldOfView(camera_, fov);
  makeMaps();
}

void StereoRectification::makeMaps() {
  const cv::Matx33d P(camera_.fx, 0.0, camera_.cx, 0.0, camera_.fy, camera_.cy, 0.0, 0.0, 1.0);
  for (std::size_t side : {0u, 1u}) {
    const RawCamera& raw = raw_[side];
    const cv::Size size(camera_.width, camera_.height);
    if (raw.is_equidistant)
      cv::fisheye::initUndistortRectifyMap(raw.K, raw.D, rotations_[side], P, size, CV_32FC1, map_x_[side],
                                           map_y_[side]);
    else
      cv::initUndistortRectifyMap(raw.K, raw.D, rotations_[side], P, size, CV_32FC1, map_x_[side], map_y_[side]);
  }
}

void StereoRectification::mount(const Eigen::Isometry3d& T_body_raw_left) {
  Eigen::Matrix3d R_rectified_raw;
  cv::cv2eigen(rotations_[0], R_rectified_raw);
  T_body_left_ = T_body_raw_left * Eigen::Isometry3d(R_rectified_raw.transpose());
}

ImagePair StereoRectification::rectify(const ImagePair& raw) const {
  ImagePair pair;
  cv::remap(raw.left, pair.left, map_x_[0], map_y_[0], cv::INTER_LINEAR);
  cv::remap(raw.right, pair.right, map_x_[1], map_y_[1], cv::INTER_LINEAR);
  return pair;
}

}  // namespace sdvo
