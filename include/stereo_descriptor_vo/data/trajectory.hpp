#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Poses T_world_camera in the order of the frames; translations in m.
using Trajectory = std::vector<Eigen::Isometry3d>;

/// Poses with their stamps, in the order of time; both lists have the same length.
struct StampedTrajectory {
  std::vector<std::int64_t> stamps;  ///< ns; none where a file has none
  Trajectory poses;
  std::vector<std::string> remarks = {};  ///< what is unusual about a file, in words
};

/// Pose from the rows of its 3x4 matrix. A rotation written with few digits is replaced by the nearest exact one;
/// throws std::invalid_argument when the matrix is none (rows not orthonormal to 1e-3, a reflection, or not finite).
Eigen::Isometry3d poseFromRows(const std::array<double, 12>& rows);

/// Reads poses in the format that the first lines show. KITTI's has 12 numbers, also behind a stamp. TUM's is "stamp tx
/// ty tz qx qy qz qw", TartanAir's the same without a stamp. EuRoC's is CSV: stamp in ns, x, y, z, qw, qx, qy, qz, …, of
/// the body. Other tables are read by a head line that names their columns. Stamps may be in s, ms, µs or ns. Lines of NaN
/// behind a stamp are left out. Throws std::runtime_error that names file, line and these formats.
StampedTrajectory readPoses(const std::string& path);

/// Reads KITTI poses (one line of 12 numbers per frame: 3x4, row-major). Throws std::runtime_error that names file and
/// line when a line is malformed; blank lines are only allowed at the end, since they would shift the frames after
/// them.
Trajectory readKittiPoses(const std::string& path);

/// Writes KITTI poses, one line per frame; throws std::runtime_error that names the file when it cannot be written.
void writeKittiPoses(const std::string& path, const Trajectory& poses);

/// Writes TUM poses ("stamp[s] tx ty tz qx qy qz qw"); throws std::invalid_argument when the lists differ in length,
/// std::runtime_error as above.
void writeTumPoses(const std::string& path, const StampedTrajectory& trajectory);

/// Mean KITTI errors over the sub-paths of one length; NaN when there is none.
struct SubPathErrors {
  double length = 0.0;               ///< m; 0 for the mean over all lengths
  int count = 0;                     ///< sub-paths
  double translation_percent = 0.0;  ///< of the length
  double rotation_deg_per_m = 0.0;
};

/// The errors of an estimated trajectory. Quantities without any sample are NaN.
struct TrajectoryErrors {
  int frames = 0;            ///< compared, which is the length of the estimate
  double path_length = 0.0;  ///< of the ground truth over these frames, m

  SubPathErrors sub_paths;                ///< mean over all sub-paths of all lengths
  std::vector<SubPathErrors> per_length;  ///< one per requested length, in that order
  double rpe_translation_m = 0.0;         ///< rmse from frame to frame
  double rpe_rotation_deg = 0.0;          ///< rmse from frame to frame
  double ate_aligned_m = 0.0;             ///< rmse of positions after the best rigid alignment (no scale)
  double ate_first_pose_m = 0.0;          ///< rmse of positions with the first poses laid upon each other
  double final_drift_m = 0.0;             ///< position error of the last frame, first poses laid upon each other
  double final_drift_percent = 0.0;       ///< of the path length
  double final_drift_deg = 0.0;           ///< rotation error of the last frame, first poses laid upon each other
  double largest_drift_m = 0.0;           ///< the same of the worst frame
  double largest_drift_deg = 0.0;         ///< … which may be another one
  double scale = 0.0;                     ///< median over steps of estimated / true step length
};

/// The official lengths of the KITTI benchmark: 100, 200 … 800 m.
std::vector<double> kittiLengths();

/// Distance travelled until each pose, m: starts with 0, as long as the trajectory.
std::vector<double> distancesTravelled(const Trajectory& poses);

/// Errors as in the KITTI development kit. A sub-path starts at every frame (step 1) and ends at the first frame at
/// which the distance along the ground truth reaches the length. Its error is inv(delta_truth) * delta_estimate,
/// divided by the nominal length. The mean is over sub-paths, not over lengths, and comes last, with length 0. Throws
/// std::invalid_argument when a length is not positive or the trajectories cannot be compared (see below).
std::vector<SubPathErrors> subPathErrors(const Trajectory& ground_truth, const Trajectory& estimate,
                                         const std::vector<double>& lengths);

/// All errors of `estimate`, which is compared to the first poses of `ground_truth`. Throws std::invalid_argument when
/// the estimate is empty or longer than the ground truth, or when a length is not positive.
TrajectoryErrors evaluateTrajectory(const Trajectory& ground_truth, const Trajectory& estimate,
                                    const std::vector<double>& lengths = kittiLengths());

/// The pose at a stamp (ns), interpolated; none in gaps of more than 0.5 s and outside.
std::optional<Eigen::Isometry3d> poseAt(const StampedTrajectory& truth, std::int64_t stamp);

/// True poses of a recording's pairs from a file that readPoses() reads. With stamps in the file they are those at
/// `stamps` (ns), and none in its gaps. Without, pair i has the line `numbers`[i] (from 0 on), or `first` lines later if
/// the file has so many. Throws std::runtime_error that names the file if it cannot be read or has no such pose.
std::vector<std::optional<Eigen::Isometry3d>> readGroundTruth(const std::string& path,
                                                              const std::vector<std::int64_t>& stamps,
                                                              const std::vector<std::size_t>& numbers,
                                                              std::size_t first = 0);

}  // namespace sdvo
