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

}  // namespace

stereo_descriptor_vo::StereoFeatures toMessage(const StereoFeatures& features, const DepthScaleOptions& size_curve) {
  stereo_descriptor_vo::StereoFeatures message;
  message.image_width = static_cast<std::uint32_t>(features.camera.width);
  message.image_height = static_cast<std::uint32_t>(features.camera.height);
  message.fx = features.camera.fx;
  message.fy = features.camera.fy;
  message.cx = features.camera.cx;
  message.cy = features.camera.cy;
  message.baseline = features.camera.baseline;
  message.right_delay = static_cast<float>(features.right_delay);
  message.descriptor = features.descriptor;
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

  const ExtractionReport& report = features.report;
  message.detected = static_cast<std::uint32_t>(report.detected);
  for (int side = 0; side < 2; ++side) {
    message.mean_intensity[side] = static_cast<float>(report.mean_intensity[side]);
    message.sharpness[side] = static_cast<float>(report.sharpness[side]);
  }
  message.detect_time = static_cast<float>(report.detect_time);
  message.stereo_time = static_cast<float>(report.stereo_time);
  message.describe_time = static_cast<float>(report.describe_time);
  message.refused = report.refused;
  message.status = report.status;

  StereoFeatures::forEachArray<stereo_descriptor_vo::StereoFeatures>(
      [&](auto ours, auto theirs) { message.*theirs = features.*ours; });
  message.descriptors = bytesOf(features.descriptors);
  message.patch_side = static_cast<std::uint32_t>(features.patch_layout.side);
  message.patch_min_spacing = features.patch_layout.min_spacing;
  message.patch_spacing = features.patch_layout.spacing_by_size;
  message.patches = bytesOf(features.patches);
  return message;
}

StereoFeatures fromMessage(const StereoFeaturesView& view) {
  const stereo_descriptor_vo::StereoFeatures& message = view.message();
  StereoFeatures features;
  features.stamp = static_cast<std::int64_t>(message.header.stamp.toNSec());
  features.camera = {message.fx,
                     message.fy,
                     message.cx,
                     message.cy,
                     message.baseline,
                     static_cast<int>(message.image_width),
                     static_cast<int>(message.image_height)};
  features.right_delay = message.right_delay;
  features.descriptor = message.descriptor;
  features.layout = valueOf<DescriptorLayout>(message.layout);
  features.element_type = valueOf<ElementType>(message.element_type);
  StereoFeatures::forEachArray<stereo_descriptor_vo::StereoFeatures>(
      [&](auto ours, auto theirs) { features.*ours = message.*theirs; });
  features.descriptors = cv::Mat(features.count(), static_cast<int>(message.bytes_per_row), CV_8U,
                                 const_cast<std::uint8_t*>(message.descriptors.data()))
                             .clone();
  features.patch_layout = view.patchLayout();
  features.patches = view.patches().clone();

  ExtractionReport& report = features.report;
  report.detected = static_cast<int>(message.detected);
  for (int side = 0; side < 2; ++side) {
    report.mean_intensity[side] = message.mean_intensity[side];
    report.sharpness[side] = message.sharpness[side];
  }
  report.detect_time = message.detect_time;
  report.stereo_time = message.stereo_time;
  report.describe_time = message.describe_time;
  report.refused = message.refused;
  report.status = message.status;
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
