#pragma once

#include <map>
#include <string>
#include <vector>

#include "finding.hpp"
#include "row_readout.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"

namespace sdvo {

/// Statistics of the odometry: states, inliers, rotation from pair to pair.
class OdometryCheck {
 public:
  /// `readout`: time from the first row to the last, s, that the odometry compensates; 0 if none.
  explicit OdometryCheck(double readout = 0.0) : compensated_(readout) {}

  void add(const StereoFeatures& features, const OdometryResult& result);

  Finding judge() const;
  /// Whether all rows of an image are taken at one moment, or a later one is compensated.
  Finding shutter() const;

  const std::vector<double>& rotations() const { return rotations_; }  ///< deg, of each measured motion

 private:
  int lost_ = 0, degraded_ = 0, tracking_ = 0;
  double distance_ = 0.0;  ///< m
  double compensated_;
  RowReadout readout_;
  std::vector<double> inliers_, rotations_;
  std::map<std::string, int> reasons_;  ///< of pairs that are not TRACKING
};

}  // namespace sdvo
