#include "feature_conversions.hpp"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace sdvo::ros_conversions {
namespace {

/// The bytes of a matrix, row by row.
std::vector<std::uint8_t> bytesOf(const cv::Mat& matrix) {
  CV_Assert(matrix.empty() || matrix.isContinuous());
  const std::uint8_t* first = matrix.data;  // not datastart: it may be part of a larger one
  return {first, first + matrix.total() * matrix.elemSize()};
}

/// Calls `assign` with each field of the message and the core's field of the same meaning, but for arrays and enums.
template <class Message, class Features, class Assign>
void forEachField(Message& message, Features& features, const Assign& assign) {
  auto& camera = features.camera;
  assign(message.image_width, camera.width);
  assign(message.image_height, camera.height);
  assign(message.fx, camera.fx);
  assign(message.fy, camera.fy);
  assign(message.cx, camera.cx);
  assign(message.cy, camera.cy);
  assign(message.baseline, camera.baseline);
  assign(message.right_delay, features.right_delay);
  assign(message.descriptor, features.descriptor);
  assign(message.patch_side, features.patch_layout.side);
  assign(message.patch_min_spacing, features.patch_layout.min_spacing);
  assign(message.patch_spacing, features.patch_layout.spacing_by_size);
  auto& report = features.report;
  assign(message.detected, report.detected);
  for (std::size_t side : {0u, 1u}) {
    assign(message.mean_intensity[side], report.mean_intensity[side]);
    assign(message.sharpness[side], report.sharpness[side]);
  }
  assign(message.noise, report.noise);
  assign(message.detect_time, report.detect_time);
  assign(message.stereo_time, report.stereo_time);
  assign(message.describe_time, report.describe_time);
  assign(message.refused, report.refused);
  assign(message.status, report.status);
}

template <class To, class From>
void convert(To& to, const From& from) {
  to = static_cast<To>(from);
}

}  // namespace

stereo_descriptor_vo::StereoFeatures toMessage(const StereoFeatures& features, const DepthScaleOptions& size_curve) {
  stereo_descriptor_vo::StereoFeatures message;
  forEachField(message, features, [](auto& theirs, const auto& ours) { convert(theirs, ours); });
  message.layout = nameOf(features.layout);
  message.element_type = nameOf(features.element_type);
  message.bytes_per_row = static_cast<std::uint32_t>(features.descriptors.cols);
  message.scale_normalised = size_curve.scale_normalisation;
  message.size_slope = static_cast<float>(size_curve.slope);
  message.size_exponent = static_cast<float>(size_curve.exponent);
  message.size_offset = static_cast<float>(size_curve.offset);
  message.size_min =
      static_cast<float>(size_curve.scale_normalisation ? size_curve.min_size : size_curve.constant_size);
  message.size_max =
      static_cast<float>(size_curve.scale_normalisation ? size_curve.max_size : size_curve.constant_size);

  StereoFeatures::forEachArray<stereo_descriptor_vo::StereoFeatures>(
      [&](auto ours, auto theirs) { message.*theirs = features.*ours; });
  message.descriptors = bytesOf(features.descriptors);
  message.patches = bytesOf(features.patches);
  return message;
}

StereoFeatures fromMessage(const StereoFeaturesView& view) {
  const stereo_descriptor_vo::StereoFeatures& message = view.message();
  StereoFeatures features;
  features.stamp = static_cast<std::int64_t>(message.header.stamp.toNSec());
  forEachField(message, features, [](const auto& theirs, auto& ours) { convert(ours, theirs); });
  features.layout = valueOf<DescriptorLayout>(message.layout);
  features.element_type = valueOf<ElementType>(message.element_type);
  StereoFeatures::forEachArray<stereo_descriptor_vo::StereoFeatures>(
      [&](auto ours, auto theirs) { features.*ours = message.*theirs; });
  features.descriptors = cv::Mat(features.count(), static_cast<int>(message.bytes_per_row), CV_8U,
                                 const_cast<std::uint8_t*>(message.descriptors.data()))
                             .clone();
  features.patches = view.patches().clone();
  return features;
}

sensor_msgs::PointCloud2 toPointCloud(const StereoFeaturesView& view) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header = view.message().header;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2Fields(4, "x", 1, sensor_msgs::PointField::FLOAT32, "y", 1, sensor_msgs::PointField::FLOAT32,
                                "z", 1, sensor_msgs::PointField::FLOAT32, "disparity", 1,
                                sensor_msgs::PointField::FLOAT32);
  modifier.resize(static_cast<std::size_t>(view.count()));
  if (view.count() == 0) return cloud;  // of which the iterator would take the first byte
  sensor_msgs::PointCloud2Iterator<float> out(cloud, "x");
  for (int i = 0; i < view.count(); ++i, ++out) {
    const cv::Point3d point = view.point(i);
    out[0] = static_cast<float>(point.x);
    out[1] = static_cast<float>(point.y);
    out[2] = static_cast<float>(point.z);
    out[3] = view.message().disparity[i];
  }
  return cloud;
}

}  // namespace sdvo::ros_conversions
