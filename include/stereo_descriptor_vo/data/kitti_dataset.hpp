#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

class StereoRectification;

/// A pair of the same size, CV_8U grey.
struct ImagePair {
  cv::Mat left, right;
};

/// "000042", the name of frame 42's files without their ending.
inline std::string kittiFrameName(int i) {
  char name[16];
  std::snprintf(name, sizeof name, "%06d", i);
  return name;
}

/// Which cameras of a KITTI car to use.
enum class KittiCameras {
  kAny,     ///< grey, or colour where the directory has neither image_0 nor image_1
  kGrey,    ///< image_0 and image_1, P0 and P1
  kColour,  ///< image_2 and image_3, P2 and P3; converted to grey
};

/// The camera of a calib.txt, which has no image size; kAny means grey. Throws std::runtime_error that names the file
/// if the two matrices are missing or belong to no rectified pair.
StereoCamera readKittiCalibration(const std::string& path, KittiCameras cameras);

/// The layouts that KittiSequence reads, in words.
std::string kittiLayouts();
/// Whether a folder has images in one of them.
bool isKittiLayout(const std::string& directory);

/// One drive of numbered images in two folders, in the layout of KITTI's odometry benchmark (image_0, image_1,
/// calib.txt, times.txt) or another one of kittiLayouts(). Numbers may begin anywhere. Every error is a
/// std::runtime_error that names the file and its fault.
///
/// The official poses are those of the left grey camera; the left colour camera sits about 6 cm beside it.
class KittiSequence {
 public:
  /// Files and values in place of the folder's own ones.
  struct Override {
    std::vector<std::string> calibration = {};  ///< of raw images, for readCalibration(); none: calib.txt
    double fov = 0.0;                           ///< of the rectified images, deg; 0: as calibrated
    double rate = 0.0;                          ///< of the pairs, Hz; 0: times.txt
  };

  /// Checks names and number of the images, the calibration and the stamps, and decodes the first left image for its
  /// size; the other images are only read by load().
  explicit KittiSequence(const std::string& directory, KittiCameras cameras = KittiCameras::kAny)
      : KittiSequence(directory, cameras, Override()) {}
  KittiSequence(const std::string& directory, KittiCameras cameras, const Override& given);

  const std::string& directory() const { return directory_; }
  /// Of the rectified views.
  const StereoCamera& camera() const { return camera_; }
  /// Of raw images; null: they are rectified.
  const StereoRectification* rectification() const { return rectification_.get(); }
  int size() const { return static_cast<int>(stamps_.size()); }
  int unpaired() const { return 0; }

  /// Time of frame i since the start of the sequence's clock, ns; strictly increasing.
  std::int64_t stamp(int i) const { return stamps_.at(static_cast<std::size_t>(i)); }
  /// Number of frame 0 in the names of its images.
  std::int64_t first() const { return first_; }

  /// Decodes frame i as the folder has it. May be called from several threads.
  ImagePair load(int i) const;
  /// The same in the views of camera().
  ImagePair loadRectified(int i) const;

 private:
  void listFrames(const std::array<std::string, 2>& folders);

  std::string directory_;
  std::vector<std::array<std::string, 2>> frames_;  ///< left and right image
  std::int64_t first_ = 0;
  cv::Size size_;  ///< of the images
  std::shared_ptr<const StereoRectification> rectification_;
  StereoCamera camera_;
  std::vector<std::int64_t> stamps_;
};

/// The ground-truth file of a sequence directory, if there is one: poses.txt or pose_left.txt (TartanAir) in it, or
/// ../../poses/NN.txt as in the official layout (directory sequences/NN).
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
