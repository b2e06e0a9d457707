#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/data/trajectory.hpp"
#include "stereo_rectification.hpp"

namespace sdvo {

/// A raw stereo sequence in the ASL layout of EuRoC and TUM-VI: a folder mav0 with cam0 and cam1. Every error is a
/// std::runtime_error that names the file and what is wrong with it.
class EurocSequence {
 public:
  /// Reads calibration and lists of images; the images are only read by load(). `calibration` and `fov` as
  /// readCalibration() has them; without files the data set's own: both sensor.yaml, or ../dso/camchain.yaml.
  explicit EurocSequence(const std::string& mav0, const std::vector<std::string>& calibration = {}, double fov = 0.0);

  int size() const { return static_cast<int>(frames_.size()); }
  /// Number of images without a partner of the other camera. They are in no frame.
  int unpaired() const { return unpaired_; }
  const StereoRectification& rectification() const { return rectification_; }

  /// Unix time of frame i, ns; strictly increasing.
  std::int64_t stamp(int i) const { return frames_.at(static_cast<std::size_t>(i)).stamp; }

  /// Decodes frame i as recorded, not rectified.
  ImagePair load(int i) const;
  /// The rectified views, and frame i in them.
  const StereoCamera& camera() const { return rectification_.camera(); }
  ImagePair loadRectified(int i) const { return rectification_.rectify(load(i)); }

  /// Poses of the rectified left camera relative to its first one, from cam0_ground_truth.txt (lines "stamp[ns] r11 r12
  /// r13 tx r21 … tz" of the raw camera). Empty, with the `problem`, if a frame has none.
  Trajectory rectifiedPoses(std::string& problem) const;

 private:
  struct Frame {
    std::int64_t stamp;
    std::string files[2];
  };

  std::string directory_;
  StereoRectification rectification_;
  std::vector<Frame> frames_;
  int unpaired_ = 0;
};

/// The folder with cam0 and cam1: `folder` itself or the mav0 in it.
std::optional<std::string> findMav0(const std::string& folder);

}  // namespace sdvo
