#pragma once

#include <Eigen/Geometry>
#include <list>
#include <memory>
#include <vector>

#include "map_point.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {

/// A key frame that is none of the newest any more, with its points as they were estimated then.
struct OldKeyframe {
  struct Point {
    AnchoredPoint position;
    Observation observation;  ///< in this key frame
    ReferencePatch reference;
  };
  int id;
  Eigen::Isometry3d T_camera_origin;
  std::vector<Point> points;
  DescribedPoints described;  ///< the points in this key frame's left optical frame

  /// How many of its points another view sees at nearly the same depth, and so nearly as large.
  int sharedWith(const StereoCamera& camera, const Eigen::Isometry3d& T_other_origin) const;
};

/// Such key frames, for a camera that comes back to their places. The map may still have some of them. Beyond the
/// capacity the one that is farthest from the newest one is forgotten.
class KeyframeMemory {
 public:
  explicit KeyframeMemory(int capacity) : capacity_(capacity) {}

  /// Keeps a key frame unless a remembered one sees most of its points.
  void remember(const StereoCamera& camera, OldKeyframe keyframe);

  /// The key frame nearest to a view, among those that share most of their points with it, at least `least`, and are
  /// within a few baselines. Errors of depths grow with the distance from their key frame. Null if there is none.
  const OldKeyframe* nearest(const StereoCamera& camera, const Eigen::Isometry3d& T_camera_origin, int least) const;

  int count() const { return static_cast<int>(keyframes_.size()); }

 private:
  int capacity_;
  std::list<std::shared_ptr<const OldKeyframe>> keyframes_;  ///< shared by copies of the memory
};

}  // namespace sdvo
