#pragma once

#include <string>
#include <vector>

#include "../../src/front_end/depth_scale.hpp"
#include "reference_sequence.hpp"

namespace sdvo {

/// One feature seen a second time: how many times larger it has to be described than in its first view.
struct SizeSample {
  double first_disparity;  ///< px
  double disparity;        ///< px, of the later view
  double ratio;            ///< size of the smallest descriptor distance / size in the first view
};

struct SizeSampling {
  double first_size = 10.0;  ///< px, in the first view
  int features = 800;        ///< followed from each start
  int stride = 5;            ///< pairs between two starts
  int max_step = 10;         ///< pairs between the two views at most
};

/// Features followed by the reference motion alone, so that no descriptor decides which ones are kept: the later view
/// is the corner next to the reprojection. Its size is searched over 0.5…4 times the first one.
std::vector<SizeSample> sampleSizes(const ReferenceSequence& sequence, const ExperimentOptions& options,
                                    const SizeSampling& sampling);

/// A curve size ~ disparity^exponent + offset, up to the common factor that ratios do not tell.
struct ShapeFit {
  std::string model;  ///< "a*d", "a*d+b", "a*d^b", "a*d^b+c"
  double exponent = 1.0;
  double offset = 0.0;           ///< px of disparity^exponent
  double median_residual = 0.0;  ///< median absolute residual of log2(ratio), octaves
  double robust_cost = 0.0;      ///< mean Cauchy cost, to compare models

  double value(double disparity) const;
};

/// Robust fits (Cauchy kernel, iteratively reweighted) of the four models to the logarithms of the ratios. Throws
/// std::runtime_error when there are fewer than 30 samples.
std::vector<ShapeFit> fitShapes(const std::vector<SizeSample>& samples);

/// A size curve and its effect on matching.
struct CurveTrial {
  DepthScaleOptions curve;
  double correct;  ///< correct matches of a pair, mean
  double gain;     ///< on those of the standard size, %, mean over the sequences
};

/// Correct matches (as in experiment A) over pairs 1, 4, 7 and 10 steps apart, which stand for its ten steps, for every
/// curve on the same key points. Needs at least two pairs in each sequence.
std::vector<CurveTrial> tryCurves(const std::vector<ReferenceSequence>& sequences, const ExperimentOptions& options,
                                  const std::vector<DepthScaleOptions>& curves, int features);

}  // namespace sdvo
