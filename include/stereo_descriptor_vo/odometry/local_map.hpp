#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <deque>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/described_points.hpp"
#include "stereo_descriptor_vo/odometry/pose_covariance.hpp"
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

  std::int64_t newestStamp() const { return newest_stamp_; }

  /// Whether features come from the same camera and, if there are any, with descriptors of the same kind.
  bool continuedBy(const StereoFeatures& features) const;

  int oldestId() const { return frames_.front().id; }
  int newestId() const { return frames_.back().id; }
  int lastKeyframeId() const;
  bool newestIsKeyframe() const { return frames_.back().is_keyframe; }
  const Eigen::Isometry3d& newestPose() const { return frames_.back().T_camera_origin; }
  /// The map as the newest pair would see it, one row for each point still looked for: the points as now estimated,
  /// with the descriptors of their last sighting.
  struct View {
    DescribedPoints rows;             ///< in the newest pair's left optical frame
    std::vector<cv::Point3f> pixels;  ///< (u_left, v_left, disparity without the rig's error) in the newest pair, px
    std::vector<int> point;           ///< what sightings call them
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
    WindowCovariances covariances;
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
  };

  void removeFrame(std::size_t index);
  void cutOff(const std::vector<std::pair<int, int>>& sources, const std::vector<double>& residuals,
              Adjustment& adjustment);
  bool needsKeyframe() const;
  static void addSighting(Point& point, const StereoFeatures& features, int row, int id);
  void startPoint(const StereoFeatures& features, int row, int id, const Eigen::Isometry3d& T_camera_origin,
                  const RigCalibration& calibration);

  LocalMapOptions options_;
  std::int64_t newest_stamp_ = 0;  ///< of the newest pair, as are camera and kind
  StereoCamera camera_;
  DescriptorKind kind_;
  std::deque<Frame> frames_;
  std::vector<Point> points_;
};

}  // namespace sdvo
