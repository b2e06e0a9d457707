#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/feature_matcher.hpp"
#include "stereo_descriptor_vo/odometry/window_optimizer.hpp"

namespace sdvo {

struct LocalMapOptions {
  int keyframes = 8;
  int remembered = 4;
  double keyframe_parallax = 4.0;
  double keyframe_overlap = 0.6;

  void describe(OptionList& list) {
    list.add("keyframes", keyframes, {2, 50}, "", "key frames that the window holds beside the newest pair");
    list.add("remembered", remembered, {1, 50}, "",
             "a point is looked for until this many frames of the map missed it");
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

  bool empty() const { return frames_.empty(); }
  std::int64_t newestStamp() const { return prototype_.stamp; }

  /// Whether features come from the same camera and, if there are any, with descriptors of the same kind.
  bool continuedBy(const StereoFeatures& features) const;

  int oldestId() const { return frames_.front().id; }
  int newestId() const { return frames_.back().id; }
  int lastKeyframeId() const;
  bool newestIsKeyframe() const { return frames_.back().is_keyframe; }
  const Eigen::Isometry3d& newestPose() const { return frames_.back().T_camera_origin; }
  /// The map as the newest pair would see it, one row for each point still looked for: positions and disparities
  /// (without the rig's error) of the points as now estimated, with the descriptors of their last sighting.
  struct View {
    StereoFeatures features;
    std::vector<int> point;          ///< for each row
    std::vector<int> row_of_newest;  ///< row of the newest pair's features, -1 where that did not see it
  };
  View view() const;

  /// Adds a pair seen from `T_camera_origin`; `sightings` are (point, row) of what it recognised, every other row
  /// becomes a new point. The previous pair is forgotten unless it was a key frame.
  struct Sighting {
    int point, row;
  };
  void insert(const StereoFeatures& features, int id, const Eigen::Isometry3d& T_camera_origin,
              const std::vector<Sighting>& sightings, const RigCalibration& calibration);

  /// Bundle adjustment over all frames; sightings that do not agree with it are cut off from their points.
  struct Adjustment {
    bool success = false;
    int frames = 0;
    /// Covariances of motions between two frames, as right perturbations (m and rad): the newest pair since the key
    /// frame before it; the newest pair since the first and since the second frame; that key frame since the first
    /// frame.
    Matrix6d since_keyframe = Matrix6d::Zero();
    Matrix6d since_first = Matrix6d::Zero(), since_second = Matrix6d::Zero();
    Matrix6d keyframe_since_first = Matrix6d::Zero();
    RigCalibration::Matrix calibration_information = RigCalibration::Matrix::Zero();
    std::vector<int> rejected_rows;  ///< of the newest pair
  };
  Adjustment adjust(const WindowOptimizerOptions& options, const CalibrationBelief& prior, RigCalibration& calibration);

 private:
  struct Frame {
    int id;
    Eigen::Isometry3d T_camera_origin;
    bool is_keyframe;
  };
  struct Observation {
    int frame_id;
    int row;
    Eigen::Vector3d measurement;
  };
  struct Point {
    AnchoredPoint position;
    std::vector<Observation> observations;  ///< in the order of the frames
    std::vector<std::uint8_t> descriptor;
    float size;
  };

  void removeFrame(std::size_t index);
  void cutOff(const std::vector<std::pair<int, int>>& sources, const std::vector<double>& residuals,
              Adjustment& adjustment);
  bool needsKeyframe() const;
  void startPoint(const StereoFeatures& features, int row, int id, const Eigen::Isometry3d& T_camera_origin,
                  const RigCalibration& calibration);

  LocalMapOptions options_;
  StereoFeatures prototype_;  ///< newest pair without its arrays: camera and descriptor kind
  int descriptor_type_ = 0;   ///< of OpenCV
  int descriptor_columns_ = 0;
  std::deque<Frame> frames_;
  std::vector<Point> points_;
};

}  // namespace sdvo
