#pragma once

#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {

struct ComparisonOptions {
  bool align = false;            ///< moves the estimate to the truth's body where these differ by a constant transform
  bool find_offset = false;      ///< adds the shift in time, or in lines, by which the motions agree best
  std::optional<double> offset;  ///< s, added to the estimate's stamps
};

/// True and estimated poses that belong together: by stamps if both files have some, else by lines.
struct TrajectoryComparison {
  Trajectory truth, estimate;
  std::vector<std::string> differences;  ///< what differs between the files beside errors, and what was done about it
};

/// Reads both files and says how they differ: units of stamps, lines without numbers, a constant shift in time or in
/// lines, a constant transform between the bodies. Throws std::runtime_error that names the files if no poses belong
/// together.
TrajectoryComparison compareTrajectories(const std::string& ground_truth, const std::string& estimate,
                                         const ComparisonOptions& options = {});

}  // namespace sdvo
