#include "pair_reader.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "../messages/camera_conversions.hpp"

namespace sdvo {
namespace {

using sensor_msgs::CameraInfo;

using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// The raw camera after the region of interest and binning.
RawCamera rawCamera(const CameraInfo& info, const StereoCamera& rectified) {
  const double x = std::max(1u, info.binning_x), y = std::max(1u, info.binning_y);
  RawCamera camera;
  camera.size = {rectified.width, rectified.height};
  camera.K = {info.K[0] / x, 0.0,           (info.K[2] - info.roi.x_offset) / x,
              0.0,           info.K[4] / y, (info.K[5] - info.roi.y_offset) / y,
              0.0,           0.0,           1.0};
  camera.setLens(info.distortion_model, info.D);
  if (!(info.K[0] > 0.0 && info.K[4] > 0.0) || !Eigen::Map<const Rows>(info.R.data()).isUnitary(1e-3))
    throw std::invalid_argument("K has no focal length, or R is no rotation: the raw camera is not calibrated");
  return camera;
}

bool isOfRectifiedImages(const CameraInfo& info) {
  const Eigen::Map<const Rows> R(info.R.data());
  return std::all_of(info.D.begin(), info.D.end(), [](double d) { return d == 0.0; }) &&
         (R.isIdentity(1e-9) || R.isZero());
}

bool areEqual(const CameraInfo& a, const CameraInfo& b) {
  return a.K == b.K && a.D == b.D && a.R == b.R && a.P == b.P && a.width == b.width && a.height == b.height &&
         a.roi == b.roi && a.binning_x == b.binning_x && a.binning_y == b.binning_y &&
         a.distortion_model == b.distortion_model;
}

}  // namespace

CameraInfo toCameraInfo(const StereoCamera& camera, int side) {
  CameraInfo message;
  message.width = static_cast<std::uint32_t>(camera.width);
  message.height = static_cast<std::uint32_t>(camera.height);
  message.distortion_model = "plumb_bob";
  message.D.assign(5, 0.0);
  const double tx = side == 0 ? 0.0 : -camera.fx * camera.baseline;
  message.K = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  message.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  message.P = {camera.fx, 0.0, camera.cx, tx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return message;
}

CameraInfo toCameraInfo(const StereoRectification& rectification, int side) {
  CameraInfo message = toCameraInfo(rectification.camera(), side);
  const RawCamera& raw = rectification.raw(side);
  message.D = raw.D;
  if (raw.is_equidistant)
    message.distortion_model = "equidistant";
  else if (raw.D.size() > 5)
    message.distortion_model = "rational_polynomial";
  else
    message.D.resize(5, 0.0);
  std::copy_n(raw.K.val, message.K.size(), message.K.begin());
  std::copy_n(rectification.rotation(side).val, message.R.size(), message.R.begin());
  return message;
}

std::optional<StereoInfos> infosOf(const StereoSource& source, cv::Size images) {
  if (source.calibration.empty()) return std::nullopt;
  const StereoRectification rectification = readCalibration(source.calibration, source.fov, images);
  return StereoInfos{toCameraInfo(rectification, 0), toCameraInfo(rectification, 1)};
}

PairReader::PairReader(const StereoTopics& topics, double fov, ros_conversions::FindTransform find)
    : may_be_raw_(topics[0].find("rect", topics[0].rfind("/image") + 1) == std::string::npos), fov_(fov), decoder_(std::move(find)) {}

RecordedPair PairReader::read(const StereoPairMessages& pair, std::int64_t stamp) {
  const DecodedPair decoded = decoder_.decode(pair);
  const std::string lens = pair.left_info->distortion_model;
  if (!may_be_raw_ || (isOfRectifiedImages(*pair.left_info) && isOfRectifiedImages(*pair.right_info)))
    return {decoded.camera, decoded.left, decoded.right,
            stamp,          lens,         ros_conversions::whyUnrectified(*pair.left_info, *pair.right_info)};
  const StereoRectification& rectification = this->rectification(pair, decoded.camera);
  const ImagePair rectified = rectification.rectify({decoded.left, decoded.right});
  return {rectification.camera(), rectified.left, rectified.right, stamp, lens + ", raw images rectified here", ""};
}

const StereoRectification& PairReader::rectification(const StereoPairMessages& pair, const StereoCamera& camera) {
  if (rectification_ && areEqual(infos_[0], *pair.left_info) && areEqual(infos_[1], *pair.right_info))
    return *rectification_;
  infos_ = {*pair.left_info, *pair.right_info};
  RawCameras raw;
  std::array<cv::Matx33d, 2> rotations;
  for (const std::size_t side : {0u, 1u}) try {
      raw[side] = rawCamera(infos_[side], camera);
      rotations[side] = cv::Matx33d(infos_[side].R.data());
    } catch (const std::invalid_argument& e) {
      throw std::invalid_argument((side == 0 ? "left camera_info: " : "right camera_info: ") + std::string(e.what()));
    }
  return rectification_.emplace(raw, rotations, fov_ > 0.0 ? withFieldOfView(camera, fov_) : camera);
}

}  // namespace sdvo
