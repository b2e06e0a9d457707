#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <vector>

#include "stereo_descriptor_vo/map/map_point.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {

/// A key frame that left the local map, with its points as they were estimated then.
struct OldKeyframe {
  struct Point {
    AnchoredPoint position;
    Observation observation;   ///< in this key frame
    ReferencePatch reference;  ///< its samples are in `samples` of the key frame
    std::size_t samples_end;   ///< where they end there; they begin where those of the point before end
  };
  int id;
  Eigen::Isometry3d T_camera_origin;
  std::vector<Point> points;
  std::vector<std::uint8_t> samples;  ///< of all references: one allocation does not fragment the heap
  DescribedPoints described;          ///< the points in this key frame's left optical frame

  /// A point's reference patch together with its samples.
  ReferencePatch reference(int point) const;

  /// How many of its points another view sees at nearly the same depth, and so nearly as large.
  int sharedWith(const StereoCamera& camera, const Eigen::Isometry3d& T_other_origin) const;
};

/// Key frames that left the map, for a camera that comes back to their places. Beyond the capacity the one that is
/// farthest from the newest one is forgotten.
class KeyframeMemory {
 public:
  explicit KeyframeMemory(int capacity) : capacity_(capacity) {}

  /// Whether a remembered key frame sees most of this one's points. Only its pose and the points' positions are used.
  bool covers(const StereoCamera& camera, const OldKeyframe& keyframe) const;

  /// Keeps a key frame unless a remembered one covers it.
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
