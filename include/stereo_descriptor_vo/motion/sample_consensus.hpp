#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/motion/genetic_consensus.hpp"
#include "stereo_descriptor_vo/motion/motion_refinement.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"
#include "stereo_descriptor_vo/motion/pose_problem.hpp"

namespace sdvo {

enum class ConsensusMethod { kRansac, kMsac, kLoRansac, kGasac, kAdaptiveGasac };

inline const std::vector<std::string>& namesOf(ConsensusMethod) {
  static const std::vector<std::string> names = {"ransac", "msac", "lo_ransac", "gasac", "adaptive_gasac"};
  return names;
}

struct SampleConsensusOptions {
  ConsensusMethod consensus = ConsensusMethod::kMsac;
  double inlier_threshold = NoiseOptions().inlierGate();  ///< px, of (u_left, v_left, u_right)
  int max_iterations = 500;
  int seed = 1;
  GeneticConsensusOptions genetic;

  void describe(OptionList& list) {
    list.add("consensus", consensus, "outlier rejection; adaptive_gasac is the paper's");
    list.add("max_iterations", max_iterations, {1, 100000}, "",
             "samples drawn at most; fewer once one without outliers was drawn with a probability of 0.9999");
    list.add("seed", seed, {0, 1000000000}, "", "of the random samples; equal seeds give equal results");
    list.group("genetic", genetic);
  }
};

/// The pose that most correspondences agree on.
struct Consensus {
  bool found = false;
  Eigen::Isometry3d T_current_reference = Eigen::Isometry3d::Identity();
  int iterations = 0;  ///< minimal samples solved
};

/// Searches by the method named in the options; all of them share solver, scoring and the bound on samples. Where the
/// method refines on the way (lo_ransac), it does so as `refinement` says, but in a few steps. Not found when no sample
/// gives a pose.
Consensus findConsensus(const PoseProblem& problem, const SampleConsensusOptions& options,
                        const MotionRefinementOptions& refinement);

}  // namespace sdvo
