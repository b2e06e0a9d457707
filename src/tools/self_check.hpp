#pragma once

#include <string>

#include "offline_run.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

/// Precision of a drive without ground truth: two estimates of it are compared. Their difference implies the error of
/// one estimate, except for errors that both share.
struct SelfCheck {
  std::string name;                ///< "shuttle" or "halves"
  int pairs = 0;                   ///< of the drive
  double distance = 0.0;           ///< m, one way
  double end_m = 0.0;              ///< distance between the two ends
  double end_deg = 0.0;            ///< angle between them
  SubPathErrors difference;        ///< mean over sub-paths of a tenth of the distance; none where the camera stands
  double error_by_difference = 0;  ///< ratio of an estimate's error to the difference
  std::string problem;             ///< why there are no figures; empty when there are

  double errorPercent() const { return error_by_difference * difference.translation_percent; }
  double errorDegPerM() const { return error_by_difference * difference.rotation_deg_per_m; }

  /// A sentence for people.
  std::string text() const;
  /// A line of a CSV, and the names of its columns.
  std::string row() const;
  static const char* columns();
};

/// End of a drive along `out` and back along `back`, in the frame of its start. `back` begins with the last pair of
/// `out`.
Eigen::Isometry3d shuttleEnd(const Trajectory& out, const Trajectory& back);

/// The drive forwards, and its pairs in reverse by an odometry that has seen nothing of the way out. If the errors of
/// both ways are independent and equally large, the error of one is the difference divided by the root of two.
SelfCheck checkShuttle(const OfflineRun& out, const OfflineRun& back);

/// The drive from two disjoint halves of its features. Each has half of the information, so twice the variance of the
/// whole. The difference of the two has four times that variance: the error of the whole is half of the difference.
SelfCheck checkHalves(const OfflineRun& whole, const OfflineRun& first, const OfflineRun& second);

}  // namespace sdvo
