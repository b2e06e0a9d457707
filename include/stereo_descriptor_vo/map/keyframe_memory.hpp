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

/// A key frame that the local map let go, and what was known of its points then.
struct OldKeyframe {
  struct Point {
    AnchoredPoint position;
    Observation observation;   ///< in this key frame
    ReferencePatch reference;  ///< without its samples
    std::size_t samples_end;   ///< … which end there and begin where those of the point before end
  };
  int id;
  Eigen::Isometry3d T_camera_origin;
  std::vector<Point> points;
  std::vector<std::uint8_t> samples;  ///< of all references: one piece of memory leaves no holes
  DescribedPoints described;          ///< the points in this key frame's left optical frame

  /// With its samples.
  ReferencePatch reference(int point) const;

  /// How many of its points a camera sees about as large as this key frame did.
  int sharedWith(const StereoCamera& camera, const Eigen::Isometry3d& T_other_origin) const;
};

/// Key frames by where they were taken: a camera that comes back finds what it saw there before. Bounded; those
/// farthest from the camera are forgotten.
class KeyframeMemory {
 public:
  explicit KeyframeMemory(int capacity) : capacity_(capacity) {}

  /// Whether an old key frame sees the same as this one, of which the pose and the points' positions are enough.
  bool covers(const StereoCamera& camera, const OldKeyframe& keyframe) const;

  /// Keeps a key frame unless an older one sees the same.
  void remember(const StereoCamera& camera, OldKeyframe keyframe);

  /// The key frame nearest to a view, of those that share most of their points with it, and at least so many. It is a
  /// few baselines away at most: seen from farther, the points' depths err too much. Null where there is none.
  const OldKeyframe* nearest(const StereoCamera& camera, const Eigen::Isometry3d& T_camera_origin, int least) const;

  int count() const { return static_cast<int>(keyframes_.size()); }

 private:
  int capacity_;
  std::list<std::shared_ptr<const OldKeyframe>> keyframes_;  ///< shared by copies of the memory
};

}  // namespace sdvo
