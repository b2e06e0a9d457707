#pragma once

#include "experiment_setup.hpp"

namespace sdvo {

/// Correct matches against the change of a feature's scale between two views of one place, for sizes by depth, constant
/// sizes, and for detectors that find the scale in the image.
struct ScaleExperiment {
  int features = 1000;                   ///< of each view and method
  std::vector<int> steps = {5, 10, 15};  ///< pairs between two views
  int stride = 5;                        ///< pairs between two first views
  double standard_size = 7.0;            ///< px, of the constant sizes
};

/// Scale changes of the table; a feature counts for the nearest one (by its logarithm).
inline const std::vector<double>& scaleChanges() {
  static const std::vector<double> changes = {1.0, 1.5, 2.0, 3.0, 4.0};
  return changes;
}

/// Index of the nearest of scaleChanges() to a ratio of depths, -1 beyond half a step outside of them.
int scaleIndex(double ratio);

/// Writes scale_change.csv to the output directory. A feature of the first view counts where its
/// 3-D point, moved by the reference motion, lies in the later image; its match is correct within 3 px of that place.
void runScaleChange(const ExperimentSetup& setup, const ScaleExperiment& experiment);

}  // namespace sdvo
