#include "camera_conversions.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <stdexcept>

#include "../common/text.hpp"
#include "frames.hpp"

namespace sdvo::ros_conversions {
namespace {

using sensor_msgs::CameraInfo;

constexpr std::uint32_t kLargestSide = 1u << 14;  // px, as feature messages have it

/// One side's rectified image. (tx, ty): P[3] and P[7] over the focal lengths, m.
struct View {
  double fx, fy, cx, cy, tx, ty;
  int width, height;
};

/// Size (px) of an image of size `all` after the region of interest (`part` of 0: all from `offset` on) and binning.
int sizeOf(const std::string& name, std::uint32_t all, std::uint32_t offset, std::uint32_t part, double binning) {
  const double pixels = part == 0 ? static_cast<double>(all) - offset : part;
  if (pixels < binning || pixels > kLargestSide)
    throw std::invalid_argument(
        text(0, name, " has no image size: ", all, " px, region of interest of ", part, " px from ", offset, " on"));
  return static_cast<int>(pixels / binning);
}

View viewOf(const CameraInfo& info, const std::string& side) {
  const std::string name = side + " camera_info";
  for (std::size_t i = 0; i < info.P.size(); ++i)
    if (!std::isfinite(info.P[i])) throw std::invalid_argument(name + ": P[" + std::to_string(i) + "] is not a number");
  // K is not needed: it is of the raw image, and drivers that rectify may leave it out.
  if (info.P[0] == 0.0 || info.P[5] == 0.0)
    throw std::invalid_argument(name + ": P is zero, the camera is not calibrated (REP-104)");
  if (info.P[0] < 0.0 || info.P[5] < 0.0) throw std::invalid_argument(name + ": a focal length in P is negative");
  const double x = std::max(1u, info.binning_x), y = std::max(1u, info.binning_y);
  return {info.P[0] / x,
          info.P[5] / y,
          (info.P[2] - info.roi.x_offset) / x,
          (info.P[6] - info.roi.y_offset) / y,
          info.P[3] / info.P[0],
          info.P[7] / info.P[5],
          sizeOf(name, info.width, info.roi.x_offset, info.roi.width, x),
          sizeOf(name, info.height, info.roi.y_offset, info.roi.height, y)};
}

std::string describeP(const CameraInfo& info) {
  std::ostringstream text;
  text << "fx = " << info.P[0] << ", fy = " << info.P[5] << ", cx = " << info.P[2] << ", cy = " << info.P[6]
       << ", Tx = " << info.P[3] << ", Ty = " << info.P[7];
  return text.str();
}

/// Remedy for a baseline that is not positive.
std::string remedy(const View& left, const View& right) {
  if (left.tx == right.tx)
    return "no baseline in P: P[3] of the right camera_info must be -fx * baseline (old camera drivers leave it out)";
  if (left.tx < 0.0)
    return "are left and right swapped? Swap the topics; with depthai_ros_driver set "
           "stereo_i_reverse_stereo_socket_order to true";
  return "P[3] of the right camera_info has the wrong sign, it must be -fx * baseline";
}

/// Distance to the right camera by TF, m; 0 with the problem: TF does not have it.
double baselineOnTf(const CameraInfo& left, const CameraInfo& right, const FindTransform& find, std::string& problem) {
  const std::string from = cleanFrameId(left.header.frame_id), to = cleanFrameId(right.header.frame_id);
  if (!find || from.empty() || to.empty() || from == to) {
    problem = find ? ", and both camera_info name the frame '" + from + "', where TF could have the right camera's" : "";
    return 0.0;
  }
  const auto T_left_right = find(from, to, problem);
  if (!T_left_right) {
    problem = ", and TF does not have '" + to + "' in '" + from + "': " + problem;
    return 0.0;
  }
  constexpr double kAside = 0.02, kTurned = 0.01;  // of the baseline; rad: a rectified pair is side by side
  const Eigen::Vector3d t = T_left_right->translation();
  if (t.x() > 0.0 && t.tail<2>().norm() < kAside * t.x() && Eigen::AngleAxisd(T_left_right->linear()).angle() < kTurned)
    return t.x();
  problem = text(3, ", and TF has '", to, "' at ", t.x(), " ", t.y(), " ", t.z(), " m in '", from,
                 "': optical frames of a rectified pair are equal but for x (to the right)");
  return 0.0;
}

/// Angle of the rectification's rotation, rad; 0 without R.
double rotation(const CameraInfo& info) {
  using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Map<const Rows> R(info.R.data());
  return (R.transpose() * R).isIdentity(1e-3) ? Eigen::AngleAxisd(Eigen::Matrix3d(R)).angle() : 0.0;
}

}  // namespace

StereoCamera toStereoCamera(const CameraInfo& left_info, const CameraInfo& right_info, const FindTransform& find) {
  const View left = viewOf(left_info, "left"), right = viewOf(right_info, "right");
  const auto both = [&] { return " (left " + describeP(left_info) + "; right " + describeP(right_info) + ")"; };
  if (left.width != right.width || left.height != right.height)
    throw std::invalid_argument(text(0, "left and right camera_info have different image sizes (left ", left.width, "x",
                                     left.height, ", right ", right.width, "x", right.height, ")"));
  constexpr double kSame = 0.05;  // px: P typed by hand, or in single precision, is rounded
  const auto differ = [](double a, double b) { return !(std::abs(a - b) <= kSame); };
  if (differ(left.fx, right.fx) || differ(left.fy, right.fy))
    throw std::invalid_argument("left and right camera_info have different focal lengths" + both() +
                                ": they are of two single calibrations, or of raw images. Calibrate both as one stereo pair (camera_calibration "
                                "or Kalibr), and rectify (stereo_raw.launch; offline --calibration)");
  // A rectification without CALIB_ZERO_DISPARITY; every depth would be wrong.
  if (differ(left.cx, right.cx) || differ(left.cy, right.cy))
    throw std::invalid_argument("left and right camera_info have different principal points" + both() +
                                ", rectify with zero disparity at infinity, and cut the same region out of both");
  // The left P may have a Tx of its own (KITTI's colour pair), so that the baseline is a difference.
  const double vertical = left.ty - right.ty;
  double baseline = left.tx - right.tx;
  std::string on_tf;
  if (left.tx == 0.0 && right.tx == 0.0 && vertical == 0.0) baseline = baselineOnTf(left_info, right_info, find, on_tf);
  if (std::abs(vertical) > std::abs(baseline))
    throw std::invalid_argument(
        text(6, "the baseline of ", std::abs(vertical), " m is vertical (P[7])") + both() +
        ": only a horizontal pair can be used. Turn images and camera_info of both cameras counter-clockwise by 90 "
        "degrees, the upper camera, now the " +
        (vertical > 0.0 ? "left" : "right") + " one, is the left one then: docs/cameras.md, 'A vertical pair'");
  if (!(baseline > 0.0))
    throw std::invalid_argument(text(6, "baseline = ", baseline, " m is not positive") + both() + ": " +
                                remedy(left, right) + on_tf);
  const StereoCamera camera{left.fx, left.fy, left.cx, left.cy, baseline, left.width, left.height};
  camera.check();
  return camera;
}

std::string whyUnrectified(const CameraInfo& left, const CameraInfo& right) {
  constexpr double kRows = 0.5;  // px, which the rig monitor sees
  for (const CameraInfo* info : {&left, &right})
    if (std::all_of(info->D.begin(), info->D.end(), [](double d) { return d == 0.0; }) &&
        rotation(*info) * info->P[5] > kRows)
      return "D of camera_info is zero and R is not the identity: image_proc does not rectify such images, it hands "
             "them on; let the driver rectify, or give D a coefficient other than zero (1e-9)";
  return "";
}

}  // namespace sdvo::ros_conversions
