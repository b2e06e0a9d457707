#include "experiment_setup.hpp"

namespace sdvo {

const std::vector<SetupDifference>& paperDifferences() {
  static const std::vector<SetupDifference> differences = {
      {"whole pixels", {"detector/subpixel=false"}, {"detector/subpixel=true"}},
      {"tracking", {"stereo/method=lk"}, {"stereo/method=epipolar"}},
      {"orientation", {"descriptor/oriented=true"}, {"descriptor/oriented=false"}},
  };
  return differences;
}

const std::vector<SetupDifference>& otherDifferences() {
  // A size of 4 px is the smallest that suits a small rig, 14 px and 60 px are what the fit on streets alone prefers.
  static const std::vector<SetupDifference> differences = {
      {"spacing 4 px", {"detector/min_spacing=4"}, {}},
      {"inside the image", {"descriptor/extend_border=false"}, {}},
      {"sizes of streets", {"size_curve/slope=0.7", "size_curve/min_size=14", "size_curve/max_size=60"}, {}},
      {"strong corners", {"detector/fast_min_threshold=12"}, {}},
  };
  return differences;
}

PipelineOptions ExperimentSetup::options() const {
  // A loose threshold, as in the paper: weak corners belong to the large feature sets.
  std::vector<std::string> all = {"stereo_features/detector/max_features=5000", "detector/area_per_feature=0", "detector/fast_min_threshold=3",
                                  "detector/corner_quality=0.0002"};
  if (setup == Setup::kPaper)
    for (const SetupDifference& difference : paperDifferences())
      all.insert(all.end(), difference.with.begin(), difference.with.end());
  all.insert(all.end(), settings.begin(), settings.end());
  return readPipelineOptions("", all);
}

}  // namespace sdvo
