#include "consensus_experiment.hpp"

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <opencv2/core.hpp>
#include <random>

#include "../../src/common/progress.hpp"
#include "../../src/motion/motion_estimator.hpp"
#include "csv_table.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {
namespace {

StereoCamera kittiLike() {
  return {707.1, 707.1, 601.9, 183.1, 0.537, 1226, 370};
}

struct Problem {
  Eigen::Isometry3d T_current_reference;
  std::vector<Correspondence> correspondences;
};

/// A car's motion of about one frame, points at road depths, and outliers as wrong matches make them: the measurement
/// of another point that is really visible.
Problem makeProblem(const ConsensusExperiment& experiment, int outlier_percent, int seed) {
  std::mt19937 random(static_cast<std::uint32_t>(seed));
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, experiment.noise);
  const StereoCamera camera = kittiLike();
  Problem problem;
  Vector6d motion;
  motion << 0.1 * (uniform(random) - 0.5), 0.05 * (uniform(random) - 0.5), -(0.8 + 0.6 * uniform(random)),
      0.01 * (uniform(random) - 0.5), 0.06 * (uniform(random) - 0.5), 0.01 * (uniform(random) - 0.5);
  problem.T_current_reference = expSE3(motion);

  std::vector<Eigen::Vector3d> measurements;
  while (static_cast<int>(measurements.size()) < experiment.correspondences) {
    const double depth = camera.depth(4.0 + 46.0 * uniform(random));
    const double u = camera.width * uniform(random), v = camera.height * uniform(random);
    const Eigen::Vector3d exact = camera.backProject(u, v, camera.disparity(depth));
    const Eigen::Vector3d moved = problem.T_current_reference * exact;
    if (moved.z() < 1.0) continue;
    Eigen::Vector3d seen = camera.project(exact), seen_again = camera.project(moved);
    for (int k = 0; k < 3; ++k) seen[k] += noise(random), seen_again[k] += noise(random);
    if (seen[0] - seen[2] < 1.0) continue;
    problem.correspondences.push_back({camera.backProject(seen[0], seen[1], seen[0] - seen[2]), seen_again});
    measurements.push_back(seen_again);
  }
  const int outliers = experiment.correspondences * outlier_percent / 100;
  for (int i = 0; i < outliers; ++i) {
    const std::size_t other = static_cast<std::size_t>(i + 1 + static_cast<int>(random() % (measurements.size() - 1)));
    problem.correspondences[static_cast<std::size_t>(i)].measurement = measurements[other % measurements.size()];
  }
  return problem;
}

bool isRight(const Problem& problem, const MotionEstimate& estimate, const PoseProblem& pose_problem) {
  if (!estimate.success) return false;
  const Eigen::Isometry3d error = problem.T_current_reference.inverse() * estimate.T_current_reference;
  const double length = problem.T_current_reference.translation().norm();
  const auto found = static_cast<double>(pose_problem.inliers(estimate.T_current_reference).size());
  const auto truth = static_cast<double>(pose_problem.inliers(problem.T_current_reference).size());
  return found >= 0.95 * truth && error.translation().norm() < 0.02 * length &&
         logSO3(error.linear()).norm() < 0.2 * CV_PI / 180.0;
}

struct Method {
  std::string name;
  ConsensusMethod consensus;
  bool learning;
};

}  // namespace

void runConsensus(const ConsensusExperiment& experiment, const std::string& output) {
  std::vector<Method> methods;
  for (const std::string& name : namesOf(ConsensusMethod{}))
    methods.push_back({name, valueOf<ConsensusMethod>(name), true});
  methods.push_back({"adaptive_gasac_without_learning", ConsensusMethod::kAdaptiveGasac, false});
  CsvTable table({"outlier_percent", "max_iterations", "method", "inliers_of_true_percent", "success_percent",
                  "samples", "cpu_ms_per_call", "first_seed", "seeds"});
  Progress progress("consensus",
                    static_cast<int>(experiment.outlier_percents.size() * experiment.budgets.size() * methods.size()));
  const StereoCamera camera = kittiLike();
  for (const int outlier_percent : experiment.outlier_percents) {
    std::vector<Problem> problems;
    for (int seed = 1; seed <= experiment.seeds; ++seed)
      problems.push_back(makeProblem(experiment, outlier_percent, seed));
    for (const int budget : experiment.budgets) {
      for (const Method& method : methods) {
        double inliers = 0.0, successes = 0.0, samples = 0.0, time = 0.0;
        for (int seed = 1; seed <= experiment.seeds; ++seed) {
          const Problem& problem = problems[static_cast<std::size_t>(seed - 1)];
          MotionEstimatorOptions options;
          static_cast<SampleConsensusOptions&>(options) = experiment.options;
          options.consensus = method.consensus;
          options.genetic.learning = method.learning;
          options.max_iterations = budget;
          options.seed = seed;
          const PoseProblem pose_problem(camera, problem.correspondences, options.inlier_threshold);
          if (seed == 1) findConsensus(pose_problem, options, options);  // warms the caches up
          const std::clock_t start = std::clock();
          const Consensus consensus = findConsensus(pose_problem, options, options);
          time += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
          // Against the inliers of the true motion: noise alone puts some correct matches beyond the threshold.
          inliers += static_cast<double>(pose_problem.inliers(consensus.T_current_reference).size()) /
                     static_cast<double>(pose_problem.inliers(problem.T_current_reference).size());
          samples += consensus.iterations;
          successes +=
              isRight(problem, MotionEstimator(options).estimate(camera, problem.correspondences), pose_problem);
        }
        const double count = experiment.seeds;
        table.add(outlier_percent, budget, method.name, 100.0 * inliers / count, 100.0 * successes / count,
                  samples / count, 1e3 * time / count, 1, experiment.seeds);
        progress.step();
      }
    }
  }
  table.write(output + "/consensus.csv");
}

}  // namespace sdvo
