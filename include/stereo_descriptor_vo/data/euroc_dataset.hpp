#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

/// A camera of an ASL folder as its sensor.yaml has it.
struct EurocCamera {
  cv::Size size;
  cv::Matx33d intrinsics;
  std::vector<double> distortion;   ///< radial-tangential: k1 k2 p1 p2
  Eigen::Isometry3d T_body_camera;  ///< m
};

/// How raw views, left and right, become rectified ones (cv::stereoRectify with alpha 0 and zero disparity).
struct StereoRectification {
  cv::Matx33d rotations[2];    ///< from the raw camera's axes to those of the rectified one
  cv::Matx34d projections[2];  ///< of the rectified cameras
  StereoCamera camera;         ///< that the rectified views have
};

/// A raw stereo sequence of EuRoC in the ASL layout: a folder mav0 with cam0 and cam1. Every error is a
/// std::runtime_error that names the file and what is wrong with it.
class EurocSequence {
 public:
  /// Reads calibrations and lists of images; the images are only read by load().
  explicit EurocSequence(const std::string& mav0);

  int size() const { return static_cast<int>(frames_.size()); }
  /// Images that the other camera has no partner for; they are no frames.
  int unpaired() const { return unpaired_; }
  const EurocCamera& camera(int side) const { return cameras_[side]; }
  const StereoRectification& rectification() const { return rectification_; }

  /// Unix time of frame i, ns; strictly increasing.
  std::int64_t stamp(int i) const { return frames_.at(static_cast<std::size_t>(i)).stamp; }

  /// Decodes frame i as recorded, not rectified.
  ImagePair load(int i) const;
  /// The views of frame i that rectification().camera has.
  ImagePair loadRectified(int i) const;

  /// Poses of the rectified left camera relative to its first one, from cam0_ground_truth.txt (lines "stamp[ns] r11 r12
  /// r13 tx r21 … tz" of the raw camera). Empty when there are not some for each frame; `problem` then says why.
  Trajectory rectifiedPoses(std::string& problem) const;

 private:
  struct Frame {
    std::int64_t stamp;
    std::string files[2];
  };

  std::string directory_;
  EurocCamera cameras_[2];
  StereoRectification rectification_;
  cv::Mat map_x_[2], map_y_[2];  ///< raw pixel of each rectified one
  std::vector<Frame> frames_;
  int unpaired_ = 0;
};

/// The folder with cam0 and cam1: `folder` itself or the mav0 in it.
std::optional<std::string> findMav0(const std::string& folder);

}  // namespace sdvo
