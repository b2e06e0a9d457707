#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "../rig/row_readout.hpp"
#include "finding.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"

namespace sdvo {

/// Statistics of the odometry: states, inliers, rotation from pair to pair.
class OdometryCheck {
 public:
  /// `readout`: time from the first row to the last, s, as the odometry was told; 0 if it was not.
  explicit OdometryCheck(double readout = 0.0) : told_(readout) {}

  void add(const OdometryResult& result);

  Finding judge() const;
  /// Whether all rows of an image are taken at one moment, and if not, whether the odometry was told so.
  Finding shutter() const;

  const std::vector<double>& rotations() const { return rotations_; }  ///< deg, of each measured motion

 private:
  int lost_ = 0, degraded_ = 0, tracking_ = 0;
  double distance_ = 0.0;  ///< m
  double told_;            ///< s
  std::optional<RowReadout::Estimate> readout_;
  std::vector<double> inliers_, rotations_;
  std::map<std::string, int> reasons_;  ///< of pairs that are not TRACKING
};

}  // namespace sdvo
