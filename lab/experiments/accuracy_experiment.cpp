#include "accuracy_experiment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "../../src/common/progress.hpp"
#include "../../src/motion/sample_consensus.hpp"
#include "aligned_motion.hpp"
#include "correct_matches.hpp"
#include "csv_table.hpp"
#include "odometry_systems.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo {
namespace {

constexpr int kSteps = 5;

/// What is done after the outlier rejection: nothing, which leaves the best sample's motion; the package's robust
/// refinement; or that with the matches aligned, too.
enum Model { kSample, kRefined, kAligned, kAlignedByDepth, kModels };
constexpr std::array<const char*, kModels> kModelNames = {"sample", "refined", "aligned", "aligned_by_depth"};

/// Subject of a row.
struct Case {
  std::string sequence;
  int features, step;
  Model model;
  ConsensusMethod method;
  std::string system;

  bool operator<(const Case& other) const {
    return std::tie(sequence, features, step, model, method, system) <
           std::tie(other.sequence, other.features, other.step, other.model, other.method, other.system);
  }
};

/// Errors of one run over a drive.
struct Run {
  double pair_percent = 0.0;  ///< sum of the pairs' translation errors, in % of the sum of their lengths
  double path_percent = 0.0;  ///< translation error of sub-paths of 5, 10 … 50 m, in % of the length
  double pair_degrees = 0.0;  ///< mean rotation error of a pair
  double failures = 0.0;      ///< pairs
  double pairs = 0.0;
};

std::vector<double> lengths() {
  std::vector<double> all;
  for (double length = 5.0; length <= 50.0; length += 5.0) all.push_back(length);
  return all;
}

/// The motions of one model over a drive seen in every step-th pair. Nothing is remembered, but that a pair whose
/// motion is not found repeats the last one.
class FollowedDrive {
 public:
  explicit FollowedDrive(const Eigen::Isometry3d& first) : truth_{first}, poses_{first} {}

  void add(const Eigen::Isometry3d& true_pose, const std::optional<Eigen::Isometry3d>& T_current_reference) {
    if (T_current_reference) motion_ = T_current_reference->inverse();
    const Eigen::Isometry3d truth = truth_.back().inverse() * true_pose, error = truth.inverse() * motion_;
    constexpr double kFailure = 0.5;  // of the length: no larger error counts
    const double length = truth.translation().norm(), largest = kFailure * length;
    const double translation = error.translation().norm();
    run_.failures += !T_current_reference || translation > largest;
    run_.pair_degrees += Eigen::AngleAxisd(error.linear()).angle() * 180.0 / M_PI;
    ++run_.pairs;
    sum_ += std::min(translation, largest);
    length_ += length;
    truth_.push_back(true_pose);
    poses_.push_back(poses_.back() * motion_);
  }

  Run errors() const {
    Run run = run_;
    run.pair_percent = 100.0 * sum_ / length_;
    run.pair_degrees /= run.pairs;
    run.path_percent = subPathErrors(truth_, poses_, lengths()).back().translation_percent;
    return run;
  }

 private:
  Trajectory truth_, poses_;
  Eigen::Isometry3d motion_ = Eigen::Isometry3d::Identity();  ///< T_reference_current
  Run run_;
  double sum_ = 0.0, length_ = 0.0;  ///< m
};

/// The matches of two pairs.
struct MatchedPair {
  int reference, current;  ///< frames
  std::vector<FeatureMatch> matches;
  std::vector<Correspondence> correspondences;
};

using Motions = std::array<std::optional<Eigen::Isometry3d>, kModels>;

Motions estimateMotions(const MotionEstimatorOptions& options, const GreyPatches& patches, const MatchedPair& pair) {
  Motions motions;
  const StereoFeatures& current = patches.by_depth[static_cast<std::size_t>(pair.current)];
  const Consensus consensus =
      findConsensus(PoseProblem(current.camera, pair.correspondences, options.inlier_threshold), options, options);
  if (consensus.found) motions[kSample] = consensus.T_current_reference;
  const MotionEstimate refined = MotionEstimator(options).estimate(current.camera, pair.correspondences);
  if (!refined.success) return motions;
  motions[kRefined] = refined.T_current_reference;
  std::vector<FeatureMatch> inliers;
  for (const int i : refined.inliers) inliers.push_back(pair.matches[static_cast<std::size_t>(i)]);
  const auto aligned = [&](const std::vector<StereoFeatures>& of_pairs, PatchWarp warp) {
    return alignedMotion(options, of_pairs[static_cast<std::size_t>(pair.reference)],
                         of_pairs[static_cast<std::size_t>(pair.current)], inliers, warp, refined.T_current_reference);
  };
  motions[kAligned] = aligned(patches.constant, PatchWarp::kNone);
  motions[kAlignedByDepth] = aligned(patches.by_depth, PatchWarp::kByDepth);
  return motions;
}

/// The rig's error in the disparities, as the package estimates it, taken out of them.
void takeOut(const RigCalibration& rig, std::vector<StereoFeatures>& pairs) {
  constexpr float kSmallest = 0.05f;  // px
  for (StereoFeatures& features : pairs)
    for (int i = 0; i < features.count(); ++i) {
      const auto error = static_cast<float>(rig.disparityError(features.camera, features.u[i], features.v[i]));
      features.disparity[i] = std::max(features.disparity[i] - error, kSmallest);
    }
}

using Results = std::map<Case, std::vector<Run>>;  // one run for each seed

/// Runs over one drive.
class DriveAccuracy {
 public:
  DriveAccuracy(const ReferenceSequence& sequence, const RigCalibration& rig, const AccuracyExperiment& experiment,
                const ExperimentOptions& options)
      : sequence_(sequence), rig_(rig), experiment_(experiment), options_(options) {}

  Results run() {
    for (const int features : experiment_.feature_counts) {
      DescribedSequence described = describeSequence(sequence_, options_, experiment_.standard_size, features);
      for (auto& pairs : described.of_system) takeOut(rig_, pairs);
      takeOut(rig_, described.patches.constant);
      takeOut(rig_, described.patches.by_depth);
      Progress progress("accuracy " + sequence_.name, kSteps * static_cast<int>(experiment_.systems.size()));
      for (int step = 1; step <= kSteps; ++step)
        for (std::size_t s = 0; s < odometrySystems().size(); ++s) {
          const std::string& system = odometrySystems()[s].name;
          if (std::count(experiment_.systems.begin(), experiment_.systems.end(), system) == 0) continue;
          follow(described.of_system[s], described.patches, system, features, step);
          progress.step();
        }
    }
    return results_;
  }

 private:
  void follow(const std::vector<StereoFeatures>& described, const GreyPatches& patches, const std::string& system,
              int features, int step) {
    std::vector<MatchedPair> pairs;
    for (int t = step; t < sequence_.frames; t += step) {
      const StereoFeatures& reference = described[static_cast<std::size_t>(t - step)];
      const StereoFeatures& current = described[static_cast<std::size_t>(t)];
      const std::vector<FeatureMatch> matches = matchByDescriptor(reference, current);
      pairs.push_back({t - step, t, matches, makeCorrespondences(reference, current, matches)});
    }
    for (const ConsensusMethod method : experiment_.methods)
      for (int seed = 1; seed <= experiment_.seeds; ++seed) {
        MotionEstimatorOptions motion = options_.visual_odometry.motion;
        motion.consensus = method;
        motion.seed = seed;
        std::vector<FollowedDrive> drives(kModels, FollowedDrive(sequence_.trajectory.front()));
        for (const MatchedPair& pair : pairs) {
          const Motions motions = estimateMotions(motion, patches, pair);
          for (std::size_t model = 0; model < kModels; ++model)
            drives[model].add(sequence_.trajectory[static_cast<std::size_t>(pair.current)], motions[model]);
        }
        for (std::size_t model = 0; model < kModels; ++model)
          results_[{sequence_.name, features, step, static_cast<Model>(model), method, system}].push_back(
              drives[model].errors());
      }
  }

  const ReferenceSequence& sequence_;
  const RigCalibration rig_;
  const AccuracyExperiment& experiment_;
  const ExperimentOptions& options_;
  Results results_;
};

}  // namespace

void runAccuracy(const ExperimentSetup& setup, const AccuracyExperiment& experiment) {
  if (std::count(experiment.systems.begin(), experiment.systems.end(), "standard") == 0)
    throw std::invalid_argument("the system 'standard' is missing: the others are compared with it");
  ExperimentOptions options = setup.options();
  const std::string hash = hashOptions(listOptions(options));
  const std::string descriptor = nameOf(options.stereo_features.descriptor.type);
  CsvTable runs({"sequence", "descriptor", "features", "step", "model", "method", "system", "seed", "pair_percent",
                 "path_percent", "pair_degrees", "failures", "pairs", "rig_offset_px", "options"});
  for (const std::string& name : setup.sequences) {
    const ReferenceSequence sequence = openSequence(setup, name, ReferenceMotion::kGroundTruth);
    const RigCalibration rig = experiment.without_rig_error ? estimateRig(sequence) : RigCalibration{};
    for (const auto& [c, of_seed] : DriveAccuracy(sequence, rig, experiment, options).run())
      for (std::size_t k = 0; k < of_seed.size(); ++k)
        runs.add(c.sequence, descriptor, c.features, c.step, kModelNames[c.model], nameOf(c.method), c.system,
                 static_cast<int>(k) + 1, of_seed[k].pair_percent, of_seed[k].path_percent, of_seed[k].pair_degrees,
                 of_seed[k].failures, of_seed[k].pairs, rig.value[0], hash);
  }
  runs.write(setup.output + "/accuracy.csv");
}

}  // namespace sdvo
