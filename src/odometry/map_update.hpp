#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "../map/local_map.hpp"
#include "pair_search.hpp"

namespace sdvo {

/// The adjustment of the map with the pair: OdometryState::candidate.
struct MapUpdate {
  bool success = false;  ///< the pair joins the map
  std::string refusal;   ///< reason if it does not and a motion was found or searched
  RigCalibration calibration;
  RigEstimate::CalibrationByRig calibration_by_rig;  ///< derivative of the window's one calibration by the rig
  double delay = 0.0;                                ///< of the right camera, compensated, s
  LocalMap::Adjustment adjustment;
  Eigen::Isometry3d motion;             ///< T_reference_current after the adjustment
  Eigen::Isometry3d T_keyframe_origin;  ///< of the last key frame, before the adjustment
  double distance = 0.0;                ///< from that key frame, m
};

/// Adjusts a copy of the map with the pair in it. A motion may be refused before or after that. If the adjustment
/// rejects so many inliers that the motion is not beyond doubt, all hypotheses compete: the pair's motion may change.
MapUpdate updateMap(const VisualOdometryOptions& options, const std::optional<Floor>& floor, OdometryTools& tools,
                    SearchedPair& pair, OdometryState& state);

}  // namespace sdvo
