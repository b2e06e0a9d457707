#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <stereo_descriptor_vo/StereoFeatures.h>

#include "../front_end/depth_scale.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/messages/stereo_features_view.hpp"

namespace sdvo::ros_conversions {

/// Header, stream epoch and drop counter are the caller's to fill.
stereo_descriptor_vo::StereoFeatures toMessage(const StereoFeatures& features, const DepthScaleOptions& size_curve);

/// The result owns its memory.
StereoFeatures fromMessage(const StereoFeaturesView& view);
/// Throws std::invalid_argument if the message is inconsistent.
inline StereoFeatures fromMessage(const stereo_descriptor_vo::StereoFeatures& message) {
  return fromMessage(StereoFeaturesView(message));
}

/// The features' points in the left optical frame; fields x, y, z (m) and disparity (px).
sensor_msgs::PointCloud2 toPointCloud(const StereoFeaturesView& view);

}  // namespace sdvo::ros_conversions
