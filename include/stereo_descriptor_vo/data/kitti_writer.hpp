#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

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

  /// The incomplete directory, for what else belongs into it.
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
