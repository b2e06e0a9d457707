#include "robustness_experiment.hpp"

#include <limits>
#include <numeric>

#include "../../src/common/progress.hpp"
#include "bootstrap.hpp"
#include "correct_matches.hpp"
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
  const auto described = describeSequence(sequence, options, experiment.standard_size, experiment.features).of_system;
  Sums sums = emptySums();
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

Sums sumOver(const std::vector<Sums>& drives, const std::vector<int>& chosen) {
  Sums total = emptySums();
  for (const int drive : chosen)
    for (std::size_t s = 0; s < total.size(); ++s)
      for (std::size_t k = 0; k < total[s].size(); ++k) total[s][k] += drives[static_cast<std::size_t>(drive)][s][k];
  return total;
}

/// Mean inliers of a system at one step, or (0) the mean of that over the steps, as the paper's figure is read.
double meanInliers(const std::vector<Sum>& of_system, int step) {
  if (step > 0)
    return of_system[static_cast<std::size_t>(step - 1)].inliers / of_system[static_cast<std::size_t>(step - 1)].runs;
  double mean = 0.0;
  for (int k = 1; k <= kSteps; ++k) mean += meanInliers(of_system, k) / kSteps;
  return mean;
}

/// How many more inliers than the standard system's, in %.
double gain(const Sums& sums, std::size_t system, int step) {
  return 100.0 * (meanInliers(sums[system], step) / meanInliers(sums[0], step) - 1.0);
}

}  // namespace

std::string runRobustness(const ExperimentSetup& setup, const RobustnessExperiment& experiment) {
  PipelineOptions options = setup.options();
  const std::string hash = hashOptions(listOptions(options));
  const std::string descriptor = nameOf(options.stereo_features.descriptor.type);
  CsvTable table({"sequence", "descriptor", "features", "step", "system", "matches", "inliers", "gain_percent",
                  "gain_low", "gain_high", "paper_inliers", "paper_gain_percent", "success_percent", "seeds",
                  "options"});
  // The gain's interval needs several drives, and each of them at least a pair.
  const auto report = [&](const std::string& sequence, const std::vector<Sums>& drives) {
    std::vector<int> all(drives.size());
    std::iota(all.begin(), all.end(), 0);
    const Sums sums = sumOver(drives, all);
    for (std::size_t s = 0; s < sums.size(); ++s) {
      const std::string& system = odometrySystems()[s].name;
      const auto interval = [&](int step) {
        return bootstrap(static_cast<int>(drives.size()),
                         [&](const std::vector<int>& chosen) { return gain(sumOver(drives, chosen), s, step); });
      };
      for (int step = 1; step <= kSteps; ++step) {
        const Sum& sum = sums[s][static_cast<std::size_t>(step - 1)];
        if (sum.runs == 0.0) continue;
        const auto [low, high] = interval(step);
        table.add(sequence, descriptor, experiment.features, std::to_string(step), system, sum.matches / sum.runs,
                  meanInliers(sums[s], step), gain(sums, s, step), low, high, publishedInliers(system, step),
                  publishedGain(system, step), 100.0 * sum.successes / sum.runs, experiment.seeds, hash);
      }
      const auto [low, high] = interval(0);
      const bool stereo = system == "stereo";
      table.add(sequence, descriptor, experiment.features, "1-5", system, kUnknown, meanInliers(sums[s], 0),
                gain(sums, s, 0), low, high, stereo ? 73.0 : (s == 0 ? 64.7 : kUnknown), stereo ? 19.0 : kUnknown,
                kUnknown, experiment.seeds, hash);
    }
  };
  std::vector<Sums> drives;
  for (const std::string& name : setup.sequences) {
    // The reference motion is not needed: inliers are those of the estimated one.
    const ReferenceSequence sequence = openImages(setup, name);
    drives.push_back(measure(sequence, experiment, options));
    report(sequence.name, {drives.back()});
  }
  report("mean", drives);
  table.write(setup.output + "/robustness.csv");
  return table.aligned();
}

}  // namespace sdvo
