#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "../check/camera_check.hpp"
#include "stereo_messages.hpp"

namespace sdvo {

/// A recorded drive. Its images stay on disk.
class Recording {
 public:
  using Use = std::function<void(const RecordedPair&)>;
  using Refuse = std::function<void(const std::string& why)>;

  virtual ~Recording() = default;

  /// Pairs at most.
  virtual int size() const = 0;

  /// Calls `use` for the first `limit` pairs in the order of their stamps, and `refuse` for each pair that cannot be
  /// used. Returns the number of stamps without a usable pair. Throws std::runtime_error if the recording cannot be
  /// read or, without `refuse`, has no usable pair.
  virtual int forEach(int limit, const Use& use, const Refuse& refuse = {}) = 0;

  /// Calls `use` for the pairs of the last forEach() in reverse order. Stamps are mirrored: they increase, and the time
  /// between pairs is the same.
  virtual void forEachBackwards(const Use& use) const = 0;

  /// True poses of the rectified left camera at the stamps of used pairs, as readGroundTruth() reads them: lines without
  /// stamps are of all left images, also of those in no pair. EuRoC's CSV has the IMU's poses, which become the camera's
  /// here.
  virtual std::vector<std::optional<Eigen::Isometry3d>> truth(const std::string& path,
                                                              const std::vector<std::int64_t>& stamps) const;

  /// How the messages of forEach() arrived, and where TF has the camera.
  virtual ArrivalFindings arrivals(const std::string& base_frame) const = 0;

 protected:
  /// Of all left images that came until the last used pair.
  virtual std::set<std::int64_t> leftStamps() const = 0;
  /// Number of the first left image.
  virtual std::size_t firstNumber() const { return 0; }
};

/// A bag, a folder in KITTI's layout, or a raw folder in that of EuRoC and TUM-VI (ASL). Raw images are rectified.
/// Several bags are the parts of one drive, as of `rosbag record --split`, in the order of time. Throws
/// std::runtime_error that names what is wrong.
std::unique_ptr<Recording> openRecording(const std::vector<std::string>& parts, const StereoSource& source);

}  // namespace sdvo
