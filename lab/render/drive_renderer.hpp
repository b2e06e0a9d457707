#pragma once

#include <memory>
#include <string>

#include "camera_effects.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "view_renderer.hpp"

namespace sdvo::render {

/// What the right camera really does, and its calibration does not know.
struct Misalignment {
  double disparity_offset = 0.0;  ///< added to every disparity, px
  double rotation_x = 0.0;        ///< of the right camera in its own frame, applied x first, then y, then z; degrees
  double rotation_y = 0.0;
  double rotation_z = 0.0;

  void describe(OptionList& list);
};

/// When the rows of both images are taken, which stamps do not tell.
struct Shutters {
  double right_delay = 0.0;  ///< of the right image, s
  double readout = 0.0;      ///< of a rolling shutter, from the first row to the last, s; the middle row has the stamp

  void describe(OptionList& list);
};

/// The left camera in the frame of the trajectory (x right, y down, z forward): another camera of the same robot.
struct Mount {
  double x = 0.0;    ///< m
  double z = 0.0;    ///< m
  double yaw = 0.0;  ///< to the right, degrees

  void describe(OptionList& list);
  Eigen::Isometry3d T_path_left() const;
};

struct RenderOptions {
  int samples = 4;              ///< rays per pixel
  double moving_share = 0.01;   ///< of the pixels that see a moving car, on average over the drive
  double dropped_frames = 0.0;  ///< share of the pairs that never arrive
  int seed = 1;
  CameraEffects effects;
  Misalignment misalignment;
  Shutters shutters;
  Mount mount;

  void describe(OptionList& list);
};

struct StereoPair {
  cv::Mat1b left, right;
};

/// Exact knowledge of a left image at its pixels' centres. NaN where there is only sky, and flow is NaN as well where
/// the point lies behind the next camera.
struct Truth {
  cv::Mat1f depth;      ///< along the optical axis, m
  cv::Mat1f disparity;  ///< of the rig as calibrated, px
  cv::Mat2f flow;       ///< to the left image of the next frame, px; may lead out of the image
  cv::Mat1b moving;     ///< 1 on moving cars
};

/// A drive ready to be rendered: world, light and traffic around the whole trajectory. Rendering is const, depends on
/// the seed and the frame alone and may run on many threads, each with its own Worker.
class DriveRenderer {
 public:
  using Scenery = render::Scenery;

  /// Scratch space of a thread.
  using Worker = MovingScene;

  /// Builds the world on `threads` threads. The traffic is tuned for frames `first` … `first + count - 1`.
  DriveRenderer(const DrivePath& path, Scenery scenery, const StereoCamera& camera, const RenderOptions& options,
                int first, int count, int threads);
  DriveRenderer(const DriveRenderer&) = delete;
  DriveRenderer& operator=(const DriveRenderer&) = delete;

  Worker makeWorker() const { return MovingScene(device_, car_casters_); }
  StereoPair render(int frame, Worker& worker) const;
  Truth truth(int frame, Worker& worker) const;
  /// Whether this pair never arrives; the first of a drive always does.
  bool isDropped(int frame) const;

  /// Measured on small images over the drive.
  double movingShare() const { return moving_share_; }
  const World& world() const { return world_; }

 private:
  Eigen::Isometry3d leftPoseAt(double time) const { return path_.poseAt(time) * T_path_left_; }
  View view(int side, const Eigen::Isometry3d& T_world_left) const;
  cv::Mat1f brightness(int side, double time, Worker& worker) const;
  void addRows(int side, double time, Worker& worker, int top, cv::Mat1f rows) const;
  /// How many images an exposure is the mean of: at least 8, and so many that a turn smears instead of repeating edges.
  int momentsOfExposure(double time) const;
  double measureMovingShare(int first, int count) const;
  void tuneTraffic(int first, int count);
  void setDensity(double density);

  static constexpr int kMostMoments = 64;

  DrivePath path_;
  StereoCamera camera_;
  RenderOptions options_;
  Eigen::Isometry3d T_path_left_;
  int first_;
  Device device_;
  World world_;
  Traffic traffic_;
  std::unique_ptr<RayCaster> caster_;
  std::vector<RayCaster> car_casters_;
  std::unique_ptr<ViewRenderer> renderer_;
  double moving_share_ = 0.0;
};

}  // namespace sdvo::render
