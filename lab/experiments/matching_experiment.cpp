#include "matching_experiment.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "../../src/common/progress.hpp"
#include "correct_matches.hpp"
#include "csv_table.hpp"
#include "keypoint_set.hpp"
#include "reference_sequence.hpp"

namespace sdvo {
namespace {

constexpr int kSteps = 10, kStride = 10;  // paper, algorithm 1

/// One way to choose the sizes; the scale normalised one comes first, the standard one second.
struct Side {
  std::string name;
  DepthScale curve;
};

std::vector<Side> makeSides(const ExperimentSetup& setup, DescriptorType type, const MatchingExperiment& experiment) {
  const DepthScaleOptions options = setup.withDescriptor(type).options().stereo_features.sizeCurve();
  DepthScaleOptions normalised = options;
  normalised.scale_normalisation = true;
  std::vector<Side> sides = {{"scale_normalised", DepthScale(normalised)}};
  std::vector<double> sizes = experiment.constant_sizes;
  sizes.insert(sizes.begin(), experiment.standard_size);
  for (const double size : sizes) {
    DepthScaleOptions constant = options;
    constant.scale_normalisation = false;
    constant.constant_size = size;
    sides.push_back({"constant_" + std::to_string(static_cast<int>(std::lround(size))), DepthScale(constant)});
  }
  return sides;
}

/// Correct matches of one side, by step.
struct Score {
  std::vector<int> correct = std::vector<int>(kSteps, 0);
  std::vector<int> pairs = std::vector<int>(kSteps, 0);
};

/// Subject of a row.
struct Case {
  DescriptorType descriptor;
  DescriptorLayout layout;
  int features;
  double tolerance;  ///< px

  bool operator<(const Case& other) const {
    return std::tie(descriptor, layout, features, tolerance) <
           std::tie(other.descriptor, other.layout, other.features, other.tolerance);
  }
};

using Scores = std::map<Case, std::vector<Score>>;  // [side]

/// Features of one frame on every side, largest set, with the rows of the smaller sets.
struct DescribedFrame {
  std::vector<StereoFeatures> of_side;
  std::map<int, std::vector<int>> rows_of_count;
};

class SequenceMatching {
 public:
  SequenceMatching(const ReferenceSequence& sequence, const MatchingExperiment& experiment,
                   const ExperimentSetup& setup, const ExperimentOptions& options)
      : sequence_(sequence), experiment_(experiment), options_(options) {
    for (const DescriptorType type : experiment.descriptors) {
      std::vector<DepthScale>& curves = curves_.emplace_back();
      for (const Side& side : makeSides(setup, type, experiment)) curves.push_back(side.curve);
      DescriptorOptions descriptor = options.stereo_features.descriptor;
      descriptor.type = type;
      descriptor.layout = DescriptorLayout::kLeftAndRight;  // the left layout is its left half
      descriptors_.emplace_back(descriptor);
    }
  }

  Scores run() {
    int blocks = 0;
    for (int t = 0; t + 1 < sequence_.frames; t += kStride) ++blocks;
    Progress progress("matching " + sequence_.name, blocks * static_cast<int>(descriptors_.size()));
    std::vector<std::map<int, DescribedFrame>> frames(descriptors_.size());
    std::map<int, KeypointSet> keypoints;
    for (int t = 0; t + 1 < sequence_.frames; t += kStride) {
      const int last = std::min(t + kSteps, sequence_.frames - 1);
      keypoints.clear();
      for (std::size_t d = 0; d < descriptors_.size(); ++d, progress.step()) {
        frames[d].erase(frames[d].begin(), frames[d].lower_bound(t));
        for (int i = t; i <= last; ++i) {
          if (frames[d].count(i)) continue;
          auto found = keypoints.find(i);
          if (found == keypoints.end()) {
            found = keypoints.emplace(i, findKeypoints(sequence_.images, i, options_)).first;
          }
          frames[d][i] = describe(d, found->second);
        }
        for (int i = t + 1; i <= last; ++i) compare(experiment_.descriptors[d], frames[d][t], frames[d][i], t, i);
      }
    }
    return scores_;
  }

 private:
  DescribedFrame describe(std::size_t d, const KeypointSet& set) {
    const int bucket = options_.stereo_features.detector.bucket_size;
    const std::vector<int>& counts = experiment_.feature_counts;
    const int most = *std::max_element(counts.begin(), counts.end());
    const Reach reach = [&](double size) { return descriptors_[d].reach(size); };
    const std::vector<int> chosen = selectKeypoints(set, curves_[d], reach, bucket, most);
    DescribedFrame frame;
    frame.of_side = describeKeypoints(set, chosen, curves_[d], descriptors_[d]);
    for (const int count : counts) {
      std::vector<int>& rows = frame.rows_of_count[count];
      for (const int i : selectKeypoints(set, curves_[d], reach, bucket, count)) {
        const auto row = std::lower_bound(chosen.begin(), chosen.end(), i);
        if (row != chosen.end() && *row == i) rows.push_back(static_cast<int>(row - chosen.begin()));
      }
      for (const DescriptorLayout layout : experiment_.layouts)
        for (const double tolerance : experiment_.tolerances)
          scores_[{experiment_.descriptors[d], layout, count, tolerance}].resize(curves_[d].size());
    }
    return frame;
  }

  void compare(DescriptorType descriptor, const DescribedFrame& reference, const DescribedFrame& current, int from,
               int to) {
    const Eigen::Isometry3d motion = sequence_.motion(from, to);
    const std::size_t step = static_cast<std::size_t>(to - from - 1);
    for (const int count : experiment_.feature_counts) {
      for (const DescriptorLayout layout : experiment_.layouts) {
        for (std::size_t s = 0; s < reference.of_side.size(); ++s) {
          const StereoFeatures a = selectRows(reference.of_side[s], reference.rows_of_count.at(count), layout);
          const StereoFeatures b = selectRows(current.of_side[s], current.rows_of_count.at(count), layout);
          const std::vector<FeatureMatch> matches = matchByDescriptor(a, b);
          for (const double tolerance : experiment_.tolerances) {
            Score& score = scores_[{descriptor, layout, count, tolerance}][s];
            score.correct[step] += countCorrect(a, b, matches, motion, tolerance);
            ++score.pairs[step];
          }
        }
      }
    }
  }

  const ReferenceSequence& sequence_;
  const MatchingExperiment& experiment_;
  const ExperimentOptions& options_;
  std::vector<std::vector<DepthScale>> curves_;  ///< [descriptor][side]
  std::vector<StereoDescriptor> descriptors_;
  Scores scores_;
};

}  // namespace

void runMatching(const ExperimentSetup& setup, const MatchingExperiment& experiment) {
  ExperimentOptions options = setup.options();
  const std::string hash = hashOptions(listOptions(options));
  const std::vector<Side> sides = makeSides(setup, DescriptorType::kFreak, experiment);  // their names
  CsvTable table({"sequence", "descriptor", "layout", "features", "tolerance_px", "side", "step", "correct", "pairs",
                  "reference", "options"});
  for (const std::string& name : setup.sequences) {
    const ReferenceSequence sequence = openSequence(setup, name, setup.reference);
    for (const auto& [c, scores] : SequenceMatching(sequence, experiment, setup, options).run())
      for (std::size_t s = 0; s < sides.size(); ++s)
        for (int step = 0; step < kSteps; ++step)
          if (const int pairs = scores[s].pairs[step])
            table.add(sequence.name, nameOf(c.descriptor), nameOf(c.layout), c.features, c.tolerance, sides[s].name,
                      step + 1, scores[s].correct[step], pairs, nameOf(setup.reference), hash);
  }
  table.write(setup.output + "/matching_steps.csv");
}

}  // namespace sdvo
