#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "../motion/noise.hpp"
#include "keyframe_memory.hpp"
#include "map_point.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"
#include "window_optimizer.hpp"

namespace sdvo {

/// The points around the camera and the key frames that saw them. The next pair's motion is measured against it.
///
/// A pair joins it by these calls: view() and sight() for the search of its motion, insert(), recall() if it came back
/// to an old key frame, adjust(), noteVariance(), renewAppearance(), and discountNewest() for a doubtful motion.
class LocalMap {
 public:
  explicit LocalMap(const LocalMapOptions& options);

  const LocalMapOptions& options() const { return options_; }

  std::int64_t newestStamp() const { return frames_.back().stamp; }
  /// Time from the map's newest pair to this one, s.
  double secondsUntil(const StereoFeatures& features) const {
    return static_cast<double>(features.stamp - newestStamp()) * 1e-9;
  }

  const StereoCamera& camera() const { return camera_; }

  /// Whether features come from the same camera and, if there are any, with descriptors of the same kind.
  bool continuedBy(const StereoFeatures& features) const;

  int oldestId() const { return oldest().id; }  ///< recalled key frames aside
  int newestId() const { return frames_.back().id; }
  int lastKeyframeId() const;
  bool newestIsKeyframe() const { return frames_.back().is_keyframe; }
  const Eigen::Isometry3d& newestPose() const { return frames_.back().T_camera_origin; }
  /// T_camera_origin of the last key frame before the newest pair: the map has no other pairs. There must be one.
  const Eigen::Isometry3d& poseBeforeNewest() const { return frames_[frames_.size() - 2].T_camera_origin; }
  /// T_oldest_newest, recalled key frames aside, and the time between the two, s.
  std::pair<Eigen::Isometry3d, double> motionOfWindow() const;

  /// The map in the newest pair's image: the points that are still looked for, at their present estimates, with the
  /// descriptors of their last sightings.
  struct View {
    DescribedPoints points;  ///< in the newest pair's left optical frame
    /// (u_left, v_left, disparity without the rig's error) in the newest pair, px. A point that the next motion brings
    /// into view is outside of its image.
    std::vector<cv::Point3f> pixels;
    std::vector<int> ids;     ///< Sighting::point: indices in the map, which insert() changes
    std::vector<int> seen;    ///< number of confirmed pairs that saw the point, also of those that left the map
    std::vector<int> newest;  ///< feature of the newest pair that saw the point; -1 for none
  };
  /// Points in the image of the newest pair, and those that the motion `T_next_newest` brings into the next one.
  View view(const std::optional<Eigen::Isometry3d>& T_next_newest = std::nullopt) const;

  /// Points, in view or not, that are still looked for and that at least `sightings` confirmed pairs saw. In the newest
  /// pair's left optical frame.
  DescribedPoints points(int sightings) const;

  /// A map point recognised in a pair: its observation there, and by which feature.
  struct Sighting : Observation {
    int point, feature;
    bool aligned = false;  ///< the position was found by aligning the reference patch; it is not the corner's
    double scale = 1.0;    ///< how much larger the point appears than in its reference patch; see recall() for links
  };

  /// The sighting of a point by the feature that was matched with it; the pair was seen from about `T_camera_origin`.
  /// The feature's patch is aligned with the point's reference, which is warped by the poses and the point's depth.
  /// Without patches, or where they do not agree, the position is the detected corner.
  Sighting sight(const StereoFeatures& features, const Eigen::Isometry3d& T_camera_origin, int point,
                 int feature) const;

  /// Adds a pair seen from `T_camera_origin` and its sightings. Every other feature becomes a new point; its sigma
  /// depends on whether later sightings can be aligned with it. The previous pair is forgotten unless it is a key
  /// frame.
  void insert(const StereoFeatures& features, int id, const Eigen::Isometry3d& T_camera_origin,
              const std::vector<Sighting>& sightings, const RigCalibration& calibration);

  /// Moves the newest pair's observations from its features as they were inserted to the same features elsewhere, once
  /// a better velocity has moved the rows of a rolling shutter.
  void moveNewest(const StereoFeatures& before, const StereoFeatures& now, const RigCalibration& calibration);

  /// The remembered key frame to whose place the newest pair has come back. Null if there is none, if the map still has
  /// it, or while another one is recalled.
  const OldKeyframe* revisited() const;

  /// Inserts an old key frame into the map again. `links`: sightings of its points in the newest pair, which become its
  /// observations of the newest pair's points. Their `point` is an index in `old`, their `scale` relative to `old`.
  void recall(const OldKeyframe& old, const std::vector<Sighting>& links);

  /// Moves the whole map rigidly, so that its newest pair has the pose T_newest_origin. Remembered key frames stay: the
  /// map drifted away from them.
  void moveTo(const Eigen::Isometry3d& T_newest_origin);

  /// Result of adjust().
  struct Adjustment {
    bool success = false;
    /// Covariance of the motion from the last key frame before the newest pair (right perturbation, m and rad).
    Matrix6d since_keyframe = Matrix6d::Zero();
    /// By how much the covariance of the newest pose, relative to the window's first one, exceeds the key frame's; in
    /// the newest pair's axes.
    Matrix6d growth = Matrix6d::Zero();
    /// Derivative of that motion by the calibration, m/px and rad/px.
    RigCalibration::MotionJacobian by_calibration = RigCalibration::MotionJacobian::Zero();
    RigCalibration::Matrix calibration_information = RigCalibration::Matrix::Zero();
    std::optional<double> common_disparity_square;  ///< px^2, see WindowSolution
    std::vector<int> rejected;                      ///< features of the newest pair
    double newest_square = 0.0;  ///< median of the newest pair's squared residuals, in sigmas; as chi-square of two
    int newest_measured = 0;     ///< number of these residuals
  };
  /// Bundle adjustment over all frames, which begins and ends with `calibration`. Outliers among the newest pair's
  /// observations are removed from their points.
  Adjustment adjust(WindowOptimizer& optimizer, const CalibrationBelief& prior, RigCalibration& calibration,
                    const std::optional<Floor>& floor = std::nullopt);

  /// The points at a finite distance, in the map's origin, m.
  std::vector<Eigen::Vector3d> positions() const;

  /// Stores the variance of the newest pair's measurements, in units of this rig's usual variance.
  void noteVariance(double variance) { frames_.back().variance = variance; }
  /// Mean of this over the newest pair and the key frame before it, since their motion depends on both.
  double varianceOfMotion() const;

  /// Does not count the newest pair's sightings in `seen`: a doubtful motion may follow a mover, whose points would
  /// confirm each other.
  void discountNewest();

  /// Updates the appearance of the newest pair's points that adjust() left. The descriptor becomes the newest one. The
  /// reference patch is taken anew where the point's size has changed too much.
  void renewAppearance(const StereoFeatures& features, const std::vector<Sighting>& sightings);

 private:
  struct Frame {
    int id;
    Eigen::Isometry3d T_camera_origin;
    bool is_keyframe;
    bool is_recalled;  ///< from the memory
    std::int64_t stamp = 0;
    double variance = 1.0;  ///< see noteVariance()
  };
  struct FrameObservation : Observation {
    int frame_id, feature;
  };
  struct Point {
    void placeAt(const StereoCamera& camera, const Eigen::Vector3d& measurement, const RigCalibration& calibration);

    AnchoredPoint position;
    std::vector<FrameObservation> observations;  ///< in the order of the frames
    std::vector<std::uint8_t> descriptor;
    ReferencePatch reference;
    int seen = 1;  ///< number of confirmed pairs that saw it, also of those that left the map
  };

  /// The optimizer's input, and where the map has its points and newest observations.
  struct Problem {
    Window window;
    std::vector<int> points;  ///< for each point of the window its index in the map
    std::vector<int> newest;  ///< indices of the window's observations in the newest frame
  };

  const Frame& oldest() const;
  Problem problem() const;
  void rememberKeyframe(const Frame& frame);
  void forgetKeyframe();
  OldKeyframe keyframe(const Frame& frame) const;
  std::vector<int> sharedPoints() const;
  std::vector<double> parallaxToPredecessors(std::size_t frames) const;
  int lookedForSince() const;
  /// Whether a point is matched with new pairs: if the map has two observations of it, or a recent one.
  static bool isLookedFor(const Point& point, int since);
  void removeFrame(std::size_t index);
  void rejectOutliers(const Problem& problem, const std::vector<double>& squares, Adjustment& adjustment);
  bool needsKeyframe() const;
  static void takeDescriptor(Point& point, const StereoFeatures& features, int feature);
  void startPoint(const StereoFeatures& features, int feature, int id, const Eigen::Isometry3d& T_camera_origin,
                  const RigCalibration& calibration, double sigma);

  LocalMapOptions options_;
  StereoCamera camera_;  ///< of the newest pair
  DescriptorKind kind_;  ///< of the newest pair's descriptors
  std::deque<Frame> frames_;
  std::vector<Point> points_;
  KeyframeMemory memory_;
  int last_remembered_ = -1;  ///< id of the newest key frame that was older than the `keyframes` newest ones
};

}  // namespace sdvo
