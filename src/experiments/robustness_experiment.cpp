#include "robustness_experiment.hpp"

#include <limits>

#include "../common/progress.hpp"
#include "csv_table.hpp"
#include "odometry_systems.hpp"

namespace sdvo {
namespace {

constexpr int kSteps = 5;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Figure 5 of the paper; its "SN FREAK" is, by the text, the stereo version.
double publishedInliers(const std::string& system, int step) {
  static const double stereo[kSteps] = {133.0, 103.0, 62.0, 40.0, 27.0};
  static const double standard[kSteps] = {126.0, 91.5, 51.0, 33.0, 22.0};
  if (system == "stereo") return stereo[step - 1];
  return system == "standard" ? standard[step - 1] : kUnknown;
}

double publishedGain(const std::string& system, int step) {
  return system == "stereo" ? 100.0 * (publishedInliers(system, step) / publishedInliers("standard", step) - 1.0)
                            : kUnknown;
}

struct Sum {
  double matches = 0.0, inliers = 0.0, runs = 0.0, successes = 0.0;

  void operator+=(const Sum& other) {
    matches += other.matches, inliers += other.inliers, runs += other.runs, successes += other.successes;
  }
};

using Sums = std::vector<std::vector<Sum>>;  // [system][step - 1]

Sums emptySums() {
  return Sums(odometrySystems().size(), std::vector<Sum>(kSteps));
}

Sums measure(const ReferenceSequence& sequence, const RobustnessExperiment& experiment,
             const PipelineOptions& options) {
  const auto described = describeSequence(sequence, options, experiment.standard_size, experiment.features);
  Sums sums = emptySums();
  Progress progress("robustness " + sequence.name, sequence.frames / experiment.stride + 1);
  for (int t = 0; t < sequence.frames; t += experiment.stride, progress.step()) {
    for (int step = 1; step <= kSteps && t + step < sequence.frames; ++step) {
      for (std::size_t s = 0; s < described.size(); ++s) {
        const StereoFeatures& current = described[s][static_cast<std::size_t>(t + step)];
        const auto correspondences = makeCorrespondences(described[s][static_cast<std::size_t>(t)], current);
        for (int seed = 1; seed <= experiment.seeds; ++seed) {
          MotionEstimatorOptions motion = options.visual_odometry.motion;
          motion.seed = seed;
          const MotionEstimate estimate = MotionEstimator(motion).estimate(current.camera, correspondences);
          Sum& sum = sums[s][static_cast<std::size_t>(step - 1)];
          sum.matches += static_cast<double>(correspondences.size());
          sum.inliers += estimate.success ? static_cast<double>(estimate.inliers.size()) : 0.0;
          sum.successes += estimate.success;
          ++sum.runs;
        }
      }
    }
  }
  return sums;
}

}  // namespace

std::string runRobustness(const ExperimentSetup& setup, const RobustnessExperiment& experiment) {
  PipelineOptions options = setup.options();
  const std::string hash = hashOptions(listOptions(options));
  CsvTable table({"sequence", "descriptor", "features", "step", "system", "matches", "inliers", "gain_percent",
                  "paper_inliers", "paper_gain_percent", "success_percent", "seeds", "options"});
  const auto report = [&](const std::string& sequence, const Sums& sums) {
    // The last entry of a system is the mean over the steps of the mean inliers, as the paper's figure is read.
    std::vector<double> mean_inliers(sums.size(), 0.0);
    for (std::size_t s = 0; s < sums.size(); ++s) {
      const std::string& system = odometrySystems()[s].name;
      for (int step = 1; step <= kSteps; ++step) {
        const Sum& sum = sums[s][static_cast<std::size_t>(step - 1)];
        const Sum& standard = sums[0][static_cast<std::size_t>(step - 1)];
        if (sum.runs == 0.0) continue;
        mean_inliers[s] += sum.inliers / sum.runs / kSteps;
        table.add(sequence, nameOf(options.stereo_features.descriptor.type), experiment.features, std::to_string(step),
                  system, sum.matches / sum.runs, sum.inliers / sum.runs,
                  100.0 * (sum.inliers / standard.inliers - 1.0), publishedInliers(system, step),
                  publishedGain(system, step), 100.0 * sum.successes / sum.runs, experiment.seeds, hash);
      }
      const bool stereo = system == "stereo";
      table.add(sequence, nameOf(options.stereo_features.descriptor.type), experiment.features, "1-5", system, kUnknown,
                mean_inliers[s], 100.0 * (mean_inliers[s] / mean_inliers[0] - 1.0),
                stereo ? 73.0 : (s == 0 ? 64.7 : kUnknown), stereo ? 19.0 : kUnknown, kUnknown, experiment.seeds, hash);
    }
  };
  Sums total = emptySums();
  for (const std::string& name : setup.sequences) {
    // The reference motion is not needed: inliers are those of the estimated one.
    const ReferenceSequence sequence = openImages(setup, name);
    const Sums sums = measure(sequence, experiment, options);
    report(sequence.name, sums);
    for (std::size_t s = 0; s < sums.size(); ++s)
      for (std::size_t k = 0; k < sums[s].size(); ++k) total[s][k] += sums[s][k];
  }
  report("mean", total);
  table.write(setup.output + "/robustness.csv");
  return table.aligned();
}

}  // namespace sdvo
