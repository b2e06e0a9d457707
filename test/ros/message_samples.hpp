#pragma once

#include <cstring>
#include <limits>
#include <opencv2/core.hpp>

#include "../../src/messages/camera_conversions.hpp"
#include "../../src/messages/feature_conversions.hpp"
#include "../../src/messages/frames.hpp"
#include "../../src/messages/image_conversions.hpp"
#include "../../src/messages/odometry_conversions.hpp"
#include "../../src/messages/pose_conversions.hpp"
#include "../said.hpp"

/// Messages and results to try the conversions on.
namespace sdvo::ros_conversions {

using FeaturesMessage = stereo_descriptor_vo::StereoFeatures;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Every field has a value of its own, so that a mix-up of two fields shows.
inline StereoFeatures someFeatures(ElementType type = ElementType::kBits,
                                   DescriptorLayout layout = DescriptorLayout::kLeftAndRight) {
  constexpr int kCount = 5;
  StereoFeatures features;
  features.stamp = 1403636579763555584;
  features.camera = {707.0912, 710.25, 601.8873, 183.1104, 0.5371657, 1226, 370};
  features.right_delay = -0.015625;
  features.descriptor = "sift";
  features.layout = layout;
  features.element_type = type;
  for (int i = 0; i < kCount; ++i) {
    const auto x = static_cast<float>(i);
    features.u.push_back(100.1f + 17.3f * x);
    features.v.push_back(50.7f + 3.9f * x);
    features.disparity.push_back(0.37f + 5.01f * x);
    features.dv.push_back(-0.4f + 0.1f * x);
    features.size.push_back(7.3f + x);
    features.angle.push_back(i == 0 ? -1.f : 0.3f * x);
    features.response.push_back(1e-3f * (x + 1.f));
  }
  cv::Mat rows(kCount, type == ElementType::kFloat32 ? 64 : 16, CV_8U);
  cv::RNG random(7);
  if (type == ElementType::kFloat32) {
    cv::Mat floats(kCount, 16, CV_32F);
    random.fill(floats, cv::RNG::UNIFORM, -300.0, 300.0);
    std::memcpy(rows.data, floats.data, rows.total());
  } else {
    random.fill(rows, cv::RNG::UNIFORM, 0, 256);
  }
  features.descriptors = rows;
  features.patch_layout = {11, 1.25f, 0.125f};
  features.patches.create(kCount, features.patch_layout.bytes(), CV_8U);
  random.fill(features.patches, cv::RNG::UNIFORM, 0, 256);
  features.report.detected = 1234;
  features.report.mean_intensity[0] = 101.5;
  features.report.mean_intensity[1] = 99.25;
  features.report.sharpness[0] = 3.5;
  features.report.sharpness[1] = 2.75;
  features.report.noise = 1.5;
  features.report.detect_time = 0.5;
  features.report.stereo_time = 0.25;
  features.report.describe_time = 0.125;
  features.report.status = "only a test";
  return features;
}

inline FeaturesMessage someMessage(ElementType type = ElementType::kBits,
                                   DescriptorLayout layout = DescriptorLayout::kLeftAndRight) {
  FeaturesMessage message = toMessage(someFeatures(type, layout), DepthScaleOptions());
  message.header.stamp.fromNSec(1403636579763555584u);
  message.header.frame_id = "left_optical";
  return message;
}

inline OdometryResult trackedResult() {
  OdometryResult result;
  result.state = TrackingState::kTracking;
  result.stamp = 1000000000100000007;
  result.has_pose = result.has_motion = true;
  result.dt = 0.1;
  result.pose_covariance = result.motion_covariance = 1e-4 * Matrix6d::Identity();
  return result;
}

}  // namespace sdvo::ros_conversions
