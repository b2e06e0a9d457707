#include "robustness_experiment.hpp"

#include "../../src/common/progress.hpp"
#include "correct_matches.hpp"
#include "csv_table.hpp"
#include "odometry_systems.hpp"

namespace sdvo {
namespace {

constexpr int kSteps = 5;

struct Sum {
  int matches = 0, inliers = 0, successes = 0, runs = 0;
};

using Sums = std::vector<std::vector<Sum>>;  // [system][step - 1]

Sums measure(const ReferenceSequence& sequence, const RobustnessExperiment& experiment,
             const ExperimentOptions& options) {
  const auto described = describeSequence(sequence, options, experiment.standard_size, experiment.features).of_system;
  Sums sums(described.size(), std::vector<Sum>(kSteps));
  Progress progress("robustness " + sequence.name, sequence.frames / experiment.stride + 1);
  for (int t = 0; t < sequence.frames; t += experiment.stride, progress.step()) {
    for (int step = 1; step <= kSteps && t + step < sequence.frames; ++step) {
      for (std::size_t s = 0; s < described.size(); ++s) {
        const StereoFeatures& current = described[s][static_cast<std::size_t>(t + step)];
        const StereoFeatures& reference = described[s][static_cast<std::size_t>(t)];
        const auto correspondences = makeCorrespondences(reference, current, matchByDescriptor(reference, current));
        for (int seed = 1; seed <= experiment.seeds; ++seed) {
          MotionEstimatorOptions motion = options.visual_odometry.motion;
          motion.seed = seed;
          const MotionEstimate estimate = MotionEstimator(motion).estimate(current.camera, correspondences);
          Sum& sum = sums[s][static_cast<std::size_t>(step - 1)];
          sum.matches += static_cast<int>(correspondences.size());
          sum.inliers += estimate.success ? static_cast<int>(estimate.inliers.size()) : 0;
          sum.successes += estimate.success;
          ++sum.runs;
        }
      }
    }
  }
  return sums;
}

}  // namespace

void runRobustness(const ExperimentSetup& setup, const RobustnessExperiment& experiment) {
  ExperimentOptions options = setup.options();
  const std::string hash = hashOptions(listOptions(options));
  const std::string descriptor = nameOf(options.stereo_features.descriptor.type);
  CsvTable table({"sequence", "descriptor", "features", "step", "system", "matches", "inliers", "successes", "runs",
                  "seeds", "options"});
  for (const std::string& name : setup.sequences) {
    // The reference motion is not needed: inliers are those of the estimated one.
    const ReferenceSequence sequence = openImages(setup, name);
    const Sums sums = measure(sequence, experiment, options);
    for (std::size_t s = 0; s < sums.size(); ++s)
      for (std::size_t k = 0; k < kSteps; ++k)
        if (const Sum& sum = sums[s][k]; sum.runs > 0)
          table.add(sequence.name, descriptor, experiment.features, static_cast<int>(k) + 1, odometrySystems()[s].name,
                    sum.matches, sum.inliers, sum.successes, sum.runs, experiment.seeds, hash);
  }
  table.write(setup.output + "/robustness_steps.csv");
}

}  // namespace sdvo
