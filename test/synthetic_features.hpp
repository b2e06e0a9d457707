#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// A cloud of points with descriptors of their own, seen by a rig whose errors are chosen: features without images, so
/// that what the odometry makes of noise and of a misaligned rig can be compared with the truth.
class SyntheticScene {
 public:
  StereoCamera camera;
  double position_noise = 0.3;    ///< px, normal
  double disparity_noise = 0.15;  ///< px, normal
  double disparity_offset = 0.0;  ///< px
  double disparity_bend = 0.0;    ///< px times ((u - cx) / fx)^2
  bool patches = false;           ///< with patches of a texture of each point's own, cut where the position says

  /// `count` points over a street 30 m wide and `length` metres long, down to 1.6 m below the camera.
  SyntheticScene(std::uint32_t seed, int count, double length) : random_(seed) {
    camera.fx = camera.fy = 700.0, camera.cx = 600.0, camera.cy = 180.0, camera.baseline = 0.54;
    camera.width = 1200, camera.height = 370;
    for (int i = 0; i < count; ++i) {
      points_.emplace_back(uniform(-15.0, 15.0), uniform(-6.0, 1.6), uniform(3.0, length));
      std::vector<std::uint8_t> row(128);
      for (std::uint8_t& byte : row) byte = static_cast<std::uint8_t>(random_());
      descriptors_.push_back(row);
    }
  }

  /// What the rig sees from a pose; a share of the visible points is missed at random, as detectors do.
  StereoFeatures view(const Eigen::Isometry3d& T_origin_camera, std::int64_t stamp, double missed = 0.3) {
    StereoFeatures features;
    features.stamp = stamp, features.camera = camera, features.descriptor = "freak",
    features.layout = DescriptorLayout::kLeftAndRight;
    std::vector<int> seen;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3d point = T_origin_camera.inverse() * points_[i];
      if (point.z() < 4.0 || point.z() > 60.0) continue;
      const Eigen::Vector3d projection = camera.project(point);
      const double x = point.x() / point.z();
      const double u = projection.x() + position_noise * normal_(random_);
      const double v = projection.y() + position_noise * normal_(random_);
      const double disparity = projection.x() - projection.z() + disparity_offset + disparity_bend * x * x +
                               disparity_noise * normal_(random_);
      if (u < 0 || u > camera.width - 1 || v < 0 || v > camera.height - 1 || disparity < 0.5) continue;
      if (uniform(0.0, 1.0) < missed) continue;
      features.append(
          {static_cast<float>(u), static_cast<float>(v), static_cast<float>(disparity), 0.f, 10.f, -1.f, 1.f});
      seen.push_back(static_cast<int>(i));
    }
    if (patches)
      features.patch_layout = {13, 1.f, 0.f}, features.patches.create(static_cast<int>(seen.size()), 169, CV_8U);
    features.descriptors.create(static_cast<int>(seen.size()), 128, CV_8U);
    for (std::size_t row = 0; row < seen.size() && patches; ++row) {
      const Eigen::Vector3d point = T_origin_camera.inverse() * points_[seen[row]];
      const Eigen::Vector3d projection = camera.project(point);
      const auto& byte = descriptors_[seen[row]];
      for (int j = 0; j < 13; ++j)
        for (int i = 0; i < 13; ++i) {
          // From the point, in the pixels of a view from 20 m.
          const double x = (features.u[row] + i - 6 - projection.x()) * point.z() / 20.0;
          const double y = (features.v[row] + j - 6 - projection.y()) * point.z() / 20.0;
          const double waves = std::sin(0.8 * x + byte[0]) + std::cos(0.7 * y - 0.4 * x + byte[1]);
          features.patches.at<std::uint8_t>(static_cast<int>(row), 13 * j + i) =
              static_cast<std::uint8_t>(128.5 + 50.0 * waves);
        }
    }
    for (std::size_t row = 0; row < seen.size(); ++row)
      std::copy(descriptors_[seen[row]].begin(), descriptors_[seen[row]].end(),
                features.descriptors.ptr(static_cast<int>(row)));
    return features;
  }

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / static_cast<double>(std::mt19937::max());
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<std::vector<std::uint8_t>> descriptors_;
};

/// A drive of 1 m forward per pair that swings a little to both sides and nods.
inline Eigen::Isometry3d syntheticPose(int pair) {
  return Eigen::Translation3d(0.3 * std::sin(0.2 * pair), 0.02 * std::sin(0.9 * pair), 1.0 * pair) *
         Eigen::AngleAxisd(0.06 * std::sin(0.2 * pair), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(0.005 * std::sin(0.9 * pair), Eigen::Vector3d::UnitX());
}

}  // namespace sdvo
