#pragma once

#include <cstdint>
#include <cstdio>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

/// "000042", the name of frame 42's files without their ending.
inline std::string kittiFrameName(int i) {
  char name[16];
  std::snprintf(name, sizeof name, "%06d", i);
  return name;
}

/// A rectified pair of the same size, CV_8U grey.
struct ImagePair {
  cv::Mat left, right;
};

/// Reads a PNG as CV_8U grey. Throws std::runtime_error that names the file when it is missing, no PNG, truncated or
/// damaged; cv::imread would return whatever could be decoded of it.
cv::Mat readGreyPng(const std::string& path);

/// In the format of the name's ending. Throws std::runtime_error that names the file when it cannot be written.
void writeImage(const std::string& path, const cv::Mat& image);

/// Which cameras of a KITTI car to use.
enum class KittiCameras {
  kAny,     ///< grey, or colour where the directory has neither image_0 nor image_1
  kGrey,    ///< image_0 and image_1, P0 and P1
  kColour,  ///< image_2 and image_3, P2 and P3; converted to grey
};

/// The camera of a calib.txt, which has no image size; kAny means grey. Throws std::runtime_error that names the file
/// if the two matrices are missing or belong to no rectified pair.
StereoCamera readKittiCalibration(const std::string& path, KittiCameras cameras);

/// One sequence in the layout of the KITTI odometry benchmark: a directory with image_0, image_1 (or image_2, image_3),
/// calib.txt and times.txt. Every error is a std::runtime_error that names the file and what is wrong with it.
///
/// The official poses are those of the left grey camera; the left colour camera sits about 6 cm beside it.
class KittiSequence {
 public:
  /// Checks names and number of the images, the calibration and the stamps, and decodes the first left image for its
  /// size; the other images are only read by load().
  explicit KittiSequence(const std::string& directory, KittiCameras cameras = KittiCameras::kAny);

  const std::string& directory() const { return directory_; }
  const StereoCamera& camera() const { return camera_; }
  int size() const { return static_cast<int>(stamps_.size()); }

  /// Time of frame i since the start of the sequence's clock, ns; strictly increasing.
  std::int64_t stamp(int i) const { return stamps_.at(static_cast<std::size_t>(i)); }

  /// Decodes frame i; both images have the size of camera(). May be called from several threads.
  ImagePair load(int i) const;
  /// The same, for they are rectified.
  ImagePair loadRectified(int i) const { return load(i); }

 private:
  std::string imagePath(int side, int i) const;

  std::string directory_;
  std::string image_directories_[2];  ///< left and right
  StereoCamera camera_;
  std::vector<std::int64_t> stamps_;
};

/// The ground-truth file of a sequence directory, if there is one: poses.txt in it, or ../../poses/NN.txt as in the
/// official layout (directory sequences/NN).
std::optional<std::string> findKittiPoses(const std::string& directory);

/// Writes a sequence that KittiSequence reads: image_0, image_1, calib.txt, times.txt and poses.txt. The directory gets
/// its name once it is complete; until then it ends with ".part", and it is removed when something fails before.
class KittiWriter {
 public:
  /// Throws std::runtime_error when `directory` exists and is not empty, when an interrupted run has left its ".part",
  /// or when it cannot be created.
  explicit KittiWriter(const std::string& directory);
  ~KittiWriter();
  KittiWriter(const KittiWriter&) = delete;
  KittiWriter& operator=(const KittiWriter&) = delete;

  /// The incomplete directory, for further files.
  const std::string& path() const { return partial_; }

  /// One image of frame i, side 0 (left) or 1 (right). May be called from several threads. Throws std::runtime_error
  /// that names the file when it cannot be written.
  void writeImage(int side, int i, const cv::Mat& image) const;

  /// Writes the text files and gives the directory its name. `stamps` in ns, one for each frame; without `poses`
  /// (T_world_camera) there is no poses.txt. Throws std::invalid_argument when their numbers differ, std::runtime_error
  /// as above.
  void finish(const StereoCamera& camera, const std::vector<std::int64_t>& stamps, const Trajectory& poses);

 private:
  std::string final_, partial_;
  bool finished_ = false;
};

}  // namespace sdvo
