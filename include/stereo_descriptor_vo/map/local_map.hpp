#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <deque>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/recycled.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/map/keyframe_memory.hpp"
#include "stereo_descriptor_vo/map/map_point.hpp"
#include "stereo_descriptor_vo/map/window_optimizer.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"
#include "stereo_descriptor_vo/matching/patch_alignment.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {

struct LocalMapOptions {
  int keyframes = 8;
  int lasting_points = 150;
  int remembered_keyframes = 40;
  double keyframe_parallax = 4.0;
  double keyframe_overlap = 0.6;
  NoiseOptions noise;

  void describe(OptionList& list) {
    list.add("keyframes", keyframes, {2, 50}, "",
             "newest key frames, which the map holds whatever they see; as many older ones at most, because they share "
             "points with the newest pair");
    list.add("lasting_points", lasting_points, {1, 10000}, "",
             "points that such an older key frame must share at least");
    list.add("remembered_keyframes", remembered_keyframes, {0, 1000}, "",
             "key frames that are remembered beyond that, by where they were taken, for a camera that comes back");
    list.add("keyframe_parallax", keyframe_parallax, {0.0, 500.0}, "px",
             "a pair is kept as a key frame once its points moved by this median since the last one");
    list.add("keyframe_overlap", keyframe_overlap, {0.0, 1.0}, "",
             "… or once a smaller share of its points was seen in the last key frame");
  }
};

/// The points around the camera and the last few pairs that saw them: what the next pair is measured against.
class LocalMap {
 public:
  explicit LocalMap(const LocalMapOptions& options);

  const LocalMapOptions& options() const { return options_; }

  std::int64_t newestStamp() const { return newest_stamp_; }
  /// From its newest pair to this one, s.
  double secondsUntil(const StereoFeatures& features) const {
    return static_cast<double>(features.stamp - newest_stamp_) * 1e-9;
  }

  const StereoCamera& camera() const { return camera_; }

  /// Whether features come from the same camera and, if there are any, with descriptors of the same kind.
  bool continuedBy(const StereoFeatures& features) const;

  int oldestId() const;  ///< recalled key frames aside
  int newestId() const { return frames_.back().id; }
  int lastKeyframeId() const;
  bool newestIsKeyframe() const { return frames_.back().is_keyframe; }
  const Eigen::Isometry3d& newestPose() const { return frames_.back().T_camera_origin; }
  /// T_camera_origin of the last key frame before the newest pair. There must be one.
  const Eigen::Isometry3d& poseBeforeNewest() const { return frames_[frames_.size() - 2].T_camera_origin; }

  /// The map as the newest pair would see it: each point still looked for as now estimated, with the descriptor of its
  /// last sighting.
  struct View {
    DescribedPoints points;  ///< in the newest pair's left optical frame
    /// (u_left, v_left, disparity without the rig's error) in the newest pair, px; beside its image where a point is
    /// about to enter.
    std::vector<cv::Point3f> pixels;
    std::vector<int> ids;   ///< Sighting::point
    std::vector<int> seen;  ///< in how many confirmed pairs, the map's and forgotten ones
  };
  /// Points in the image of the newest pair, and those that a turn of `T_next_newest` brings into the next one.
  View view(const std::optional<Eigen::Isometry3d>& T_next_newest = std::nullopt) const;

  /// The points still looked for that at least so many pairs saw, wherever they are, in the newest pair's left optical
  /// frame.
  DescribedPoints points(int sightings) const;

  /// A map point recognised in a pair: its observation there, and by which feature.
  struct Sighting : Observation {
    int point, feature;
    bool aligned = false;  ///< by its patch: the position is not the corner's but that of the reference's middle
    double scale = 1.0;    ///< how much larger the point appears than in its reference patch
  };

  /// The point by a feature of a pair seen from about `T_camera_origin`. The feature's patch is aligned with the
  /// point's reference, which is warped by the poses and the point's depth. Without patches, or where they do not
  /// agree, it is the corner as detected.
  Sighting sight(const PatchAlignmentOptions& options, const StereoFeatures& features,
                 const Eigen::Isometry3d& T_camera_origin, int point, int feature) const;

  /// Adds a pair seen from `T_camera_origin` and what it recognised; every other feature becomes a new point, whose
  /// later sightings `alignment` is for. The previous pair is forgotten unless it was a key frame.
  void insert(const PatchAlignmentOptions& alignment, const StereoFeatures& features, int id,
              const Eigen::Isometry3d& T_camera_origin, const std::vector<Sighting>& sightings,
              const RigCalibration& calibration);

  /// The remembered key frame whose place the newest pair has come back to; null where there is none, where it never
  /// left the map, and while another one is recalled.
  const OldKeyframe* revisited() const;

  /// A point of an old key frame in the newest pair.
  struct Link {
    int point;                 ///< of the old key frame
    int feature;               ///< of the newest pair
    Eigen::Vector2d position;  ///< (u_left, v_left) of the old key frame's point in the newest pair, px
    double sigma;              ///< of each of them, px
    double scale;              ///< how much larger the point appears now
  };
  /// Takes an old key frame into the map again, linked to the newest pair by points that both saw.
  void recall(const OldKeyframe& old, const std::vector<Link>& links);

  /// Moves the map as a whole, so that its newest pair was seen from there.
  void moveTo(const Eigen::Isometry3d& T_newest_origin);

  /// Bundle adjustment over all frames; observations that do not agree with it are cut off from their points.
  struct Adjustment {
    bool success = false;
    Matrix6d since_keyframe = Matrix6d::Zero();  ///< covariance of the newest pose since the key frame before it.
    /// Covariance of the newest pose's error in the map beyond that key frame's; errors of the map cancel.
    Matrix6d growth = Matrix6d::Zero();
    RigCalibration::MotionJacobian by_calibration = RigCalibration::MotionJacobian::Zero();  ///< since that key frame
    RigCalibration::Matrix calibration_information = RigCalibration::Matrix::Zero();
    std::optional<double> common_disparity_square;  ///< px^2, see WindowSolution
    std::vector<int> rejected;                      ///< features of the newest pair
    double newest_square = 0.0;  ///< median of the newest pair's residuals, squared in standard deviations
    int newest_measured = 0;     ///< number of these
  };
  Adjustment adjust(WindowOptimizer& optimizer, const CalibrationBelief& prior, RigCalibration& calibration,
                    const std::optional<Floor>& floor = std::nullopt);

  /// The points at a finite distance, in the map's origin, m.
  std::vector<Eigen::Vector3d> positions() const;

  /// Takes note of the variance of the newest pair's measurements, by the usual one.
  void noteVariance(double variance) { frames_.back().variance = variance; }
  /// The same of the motion since the key frame before, which rests on the measurements of both.
  double varianceOfMotion() const;

  /// The newest pair's sightings confirm no points: its motion may be something else's.
  void discountNewest();

  /// The newest pair's sightings that were not cut off renew the appearance of their points: the descriptors, and a
  /// reference patch that has become too small or too large.
  void renewAppearance(const StereoFeatures& features, const std::vector<Sighting>& sightings);

 private:
  struct Frame {
    int id;
    Eigen::Isometry3d T_camera_origin;
    bool is_keyframe;
    bool is_recalled;       ///< from the memory
    double variance = 1.0;  ///< of its measurements, by the usual one
  };
  struct FrameObservation : Observation {
    int frame_id, feature;
  };
  struct Point {
    AnchoredPoint position;
    std::vector<FrameObservation> observations;  ///< in the order of the frames
    std::vector<std::uint8_t> descriptor;
    ReferencePatch reference;
    int seen = 1;  ///< confirmed pairs, those included that the map has forgotten
  };

  /// The map as the optimizer takes it, and what of the map it is made of.
  struct Problem {
    Window window;
    std::vector<int> frame_ids;
    std::vector<int> points;  ///< for each of the window's
    std::vector<int> newest;  ///< of the window's observations those in the newest frame

    void clear();
  };

  void pose(Problem& problem) const;
  void forgetKeyframe();
  void rememberKeyframe(std::size_t frame);
  OldKeyframe keyframe(std::size_t frame, bool with_appearance) const;
  std::vector<int> sharedPoints() const;
  std::vector<double> parallaxToPredecessors(std::size_t frames) const;
  int lookedForSince() const;
  /// Whether matches with a point are sought: from its second observation on, or while the only one is recent.
  static bool isLookedFor(const Point& point, int since);
  void removeFrame(std::size_t index);
  void cutOff(const std::vector<double>& squares, Adjustment& adjustment);
  bool needsKeyframe() const;
  static void takeDescriptor(Point& point, const StereoFeatures& features, int feature);
  void startPoint(const StereoFeatures& features, int feature, int id, const Eigen::Isometry3d& T_camera_origin,
                  const RigCalibration& calibration, double sigma);

  LocalMapOptions options_;
  std::int64_t newest_stamp_ = 0;  ///< of the newest pair, as are camera and kind
  StereoCamera camera_;
  DescriptorKind kind_;
  std::deque<Frame> frames_;
  Recycled<Point> points_;
  KeyframeMemory memory_;
  int last_left_ = -1;  ///< the last key frame that was not among the newest ones any more
  Problem problem_;     ///< empty once it is solved, so that a copy of the map is none of it
};

}  // namespace sdvo
