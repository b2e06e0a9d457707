#include "accuracy_experiment.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

#include "../common/progress.hpp"
#include "csv_table.hpp"
#include "odometry_systems.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"
#include "stereo_descriptor_vo/odometry/sample_consensus.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A row of the summary.
struct Case {
  std::string sequence;
  std::string model;  ///< the last step of the motion: the best "sample" or "refined"; or the whole "package"
  ConsensusMethod method;
  std::string system;

  bool operator<(const Case& other) const {
    return std::tie(sequence, model, method, system) <
           std::tie(other.sequence, other.model, other.method, other.system);
  }
};

std::vector<double> lengths() {
  std::vector<double> all;
  for (double length = 5.0; length <= 50.0; length += 5.0) all.push_back(length);
  return all;
}

/// The paper's model: every pair is matched to the one before, nothing else is remembered. A pair whose motion is not
/// found repeats the last one. "sample": the motion is that of the best minimal sample.
Trajectory followFrameToFrame(const StereoCamera& camera,
                              const std::vector<std::vector<Correspondence>>& correspondences,
                              const MotionEstimatorOptions& options, bool refine) {
  Trajectory poses = {Eigen::Isometry3d::Identity()};
  Eigen::Isometry3d T_current_reference = Eigen::Isometry3d::Identity();
  for (const auto& of_pair : correspondences) {
    if (refine) {
      const MotionEstimate estimate = MotionEstimator(options).estimate(camera, of_pair);
      if (estimate.success) T_current_reference = estimate.T_current_reference;
    } else {
      const Consensus consensus =
          findConsensus(PoseProblem(camera, of_pair, options.inlier_threshold), options, options);
      if (consensus.found) T_current_reference = consensus.T_current_reference;
    }
    poses.push_back(poses.back() * T_current_reference.inverse());
  }
  return poses;
}

Trajectory followWithPackage(const std::vector<StereoFeatures>& features, const VisualOdometryOptions& options) {
  VisualOdometry odometry(options);
  Trajectory poses;
  for (const StereoFeatures& of_pair : features) {
    const OdometryResult result = odometry.update(of_pair);
    poses.push_back(result.has_pose ? result.T_origin_camera
                                    : (poses.empty() ? Eigen::Isometry3d::Identity() : poses.back()));
  }
  return poses;
}

/// Table 2 of the paper: best, mean, worst.
std::array<double, 3> published(const Case& c) {
  if (c.sequence == "mean" && c.method == ConsensusMethod::kAdaptiveGasac) {
    if (c.system == "stereo") return {2.47, 3.5, 4.29};
    if (c.system == "standard") return {3.43, 4.78, 8.8};
  }
  return {kUnknown, kUnknown, kUnknown};
}

struct Run {
  double translation_percent, rotation_deg_per_m;
};

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

}  // namespace

std::string runAccuracy(const ExperimentSetup& setup, const AccuracyExperiment& experiment) {
  PipelineOptions options = setup.options();
  const std::string hash = hashOptions(listOptions(options));
  CsvTable runs({"sequence", "descriptor", "features", "model", "method", "system", "seed", "translation_percent",
                 "rotation_deg_per_m", "options"});
  std::map<Case, std::vector<Run>> results;  // one run for each seed
  const auto add = [&](const Case& c, int seed, const Trajectory& truth, const Trajectory& estimate) {
    const SubPathErrors errors = subPathErrors(truth, estimate, lengths()).back();
    results[c].push_back({errors.translation_percent, errors.rotation_deg_per_m});
    runs.add(c.sequence, nameOf(options.stereo_features.descriptor.type), experiment.features, c.model,
             nameOf(c.method), c.system, seed, errors.translation_percent, errors.rotation_deg_per_m, hash);
  };

  for (const std::string& name : setup.sequences) {
    const ReferenceSequence sequence = openSequence(setup, name, ReferenceMotion::kGroundTruth);
    const auto described = describeSequence(sequence, options, experiment.standard_size, experiment.features);
    Progress progress("accuracy " + sequence.name, static_cast<int>(described.size()) * experiment.seeds);
    for (std::size_t s = 0; s < described.size(); ++s) {
      std::vector<std::vector<Correspondence>> correspondences;
      for (std::size_t i = 1; i < described[s].size(); ++i)
        correspondences.push_back(makeCorrespondences(described[s][i - 1], described[s][i]));
      for (int seed = 1; seed <= experiment.seeds; ++seed, progress.step()) {
        for (const ConsensusMethod method : experiment.methods) {
          VisualOdometryOptions odometry = options.visual_odometry;
          odometry.motion.consensus = method;
          odometry.motion.seed = seed;
          const std::string& system = odometrySystems()[s].name;
          for (const bool refine : {false, true})
            add({sequence.name, refine ? "refined" : "sample", method, system}, seed, sequence.trajectory,
                followFrameToFrame(sequence.images.camera(), correspondences, odometry.motion, refine));
          if (experiment.package_odometry)
            add({sequence.name, "package", method, system}, seed, sequence.trajectory,
                followWithPackage(described[s], odometry));
        }
      }
    }
  }

  // The mean over sequences, seed by seed.
  std::map<Case, std::vector<Run>> means;
  for (const auto& [c, of_seed] : results) {
    std::vector<Run>& total = means[{"mean", c.model, c.method, c.system}];
    total.resize(of_seed.size(), {0.0, 0.0});
    const double count = static_cast<double>(setup.sequences.size());
    for (std::size_t k = 0; k < of_seed.size(); ++k) {
      total[k].translation_percent += of_seed[k].translation_percent / count;
      total[k].rotation_deg_per_m += of_seed[k].rotation_deg_per_m / count;
    }
  }
  results.insert(means.begin(), means.end());

  CsvTable summary({"sequence", "descriptor", "features", "model", "method", "system", "seeds", "best_percent",
                    "mean_percent", "worst_percent", "paper_best", "paper_mean", "paper_worst",
                    "gain_on_standard_percent", "rotation_mean_deg_per_m", "options"});
  for (const auto& [c, of_seed] : results) {
    std::vector<double> translation, rotation, standard;
    for (const Run& run : of_seed) {
      translation.push_back(run.translation_percent);
      rotation.push_back(run.rotation_deg_per_m);
    }
    for (const Run& run : results.at({c.sequence, c.model, c.method, "standard"}))
      standard.push_back(run.translation_percent);
    const auto [best, worst] = std::minmax_element(translation.begin(), translation.end());
    const auto paper = published(c);
    summary.add(c.sequence, nameOf(options.stereo_features.descriptor.type), experiment.features, c.model,
                nameOf(c.method), c.system, static_cast<int>(of_seed.size()), *best, mean(translation), *worst,
                paper[0], paper[1], paper[2], 100.0 * (1.0 - mean(translation) / mean(standard)), mean(rotation), hash);
  }
  runs.write(setup.output + "/accuracy.csv");
  summary.write(setup.output + "/accuracy_summary.csv");
  return summary.aligned();
}

}  // namespace sdvo
