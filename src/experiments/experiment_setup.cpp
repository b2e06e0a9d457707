#include "experiment_setup.hpp"

namespace sdvo {

PipelineOptions ExperimentSetup::options() const {
  // A loose threshold, as in the paper: weak corners belong to the large feature sets.
  // Near features, whose scale changes most, are large and at the image borders: they must not be left out.
  std::vector<std::string> loose = {"stereo_features/detector/max_features=12000", "detector/area_per_feature=0",
                                    "detector/fast_min_threshold=3", "detector/corner_quality=0.0002",
                                    "descriptor/extend_border=true"};
  // Corners a few px apart look the same to a large neighbourhood; chosen on rendered drives, see docs/experiments.md.
  loose.emplace_back("detector/min_spacing=4");
  // What fit_depth_scale found on a rendered drive, see docs/experiments.md. The odometry's own defaults differ: it
  // gains nothing from large neighbourhoods, which cost it time.
  for (const char* curve : {"size_curve/slope=0.7", "size_curve/min_size=14", "size_curve/max_size=60"})
    loose.emplace_back(curve);
  loose.insert(loose.end(), settings.begin(), settings.end());
  return readPipelineOptions("", loose);
}

}  // namespace sdvo
