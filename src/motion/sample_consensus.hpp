#pragma once

#include <Eigen/Geometry>
#include <random>

#include "motion_refinement.hpp"
#include "noise.hpp"
#include "pose_problem.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// Three different indices below `count`, drawn evenly.
MinimalSample drawSample(std::mt19937& random, int count);

/// Bounds the number of samples: enough are drawn once it is likely that one of them was without outliers.
class SampleBudget {
 public:
  /// `confidence`: probability that a sample without outliers is among those drawn.
  SampleBudget(int at_most, double confidence);

  /// Takes note of the inlier ratio of the best pose so far.
  void noteInliers(double ratio);

  bool spent(int samples) const;
  /// Ratio of the budget that is used up, 0…1.
  double progress(int samples) const;

 private:
  double at_most_, confidence_;
  double needed_;
};

/// The pose that most correspondences agree on.
struct Consensus {
  bool found = false;
  Eigen::Isometry3d T_current_reference = Eigen::Isometry3d::Identity();
  double cost = 0.0;   ///< PoseProblem::truncatedCost, with kRansac outlierCost
  int iterations = 0;  ///< minimal samples solved
};

/// Searches by the method named in the options; all of them share solver, scoring and the bound on samples. Where the
/// method refines on the way (lo_ransac), it does so as `refinement` says, but in a few steps. Not found when no sample
/// gives a pose.
Consensus findConsensus(const PoseProblem& problem, const SampleConsensusOptions& options,
                        const MotionRefinementOptions& refinement);

/// Genetic algorithm sample consensus. An individual is a minimal sample, its genes are the correspondences, its
/// fitness is the consensus of its pose. With `adaptive` false the rates are fixed (GASAC, Rodehorst and Hellwich
/// 2006). With `adaptive` true unfit individuals are mutated. The search learns for each gene how good a replacement it
/// is: as good as the best pose it agrees with. Mutation so moves from random exploration to exploitation (Shojaedini,
/// Majd, Safabakhsh 2017).
Consensus searchGenetically(const PoseProblem& problem, const GeneticConsensusOptions& options, bool adaptive,
                            SampleBudget budget, std::mt19937& random);

}  // namespace sdvo
