#include "matching_experiment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "../../src/common/progress.hpp"
#include "bootstrap.hpp"
#include "correct_matches.hpp"
#include "csv_table.hpp"
#include "keypoint_set.hpp"
#include "reference_sequence.hpp"

namespace sdvo {
namespace {

constexpr int kSteps = 10, kStride = 10;  // paper, algorithm 1
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// One way to choose the sizes; the scale normalised one comes first, the standard one second.
struct Side {
  std::string name;
  double constant_size;  ///< px; 0 when the size follows the disparity
  DepthScale curve;
};

std::vector<Side> makeSides(const ExperimentSetup& setup, DescriptorType type, const MatchingExperiment& experiment) {
  const DepthScaleOptions options = setup.withDescriptor(type).options().stereo_features.sizeCurve();
  DepthScaleOptions normalised = options;
  normalised.scale_normalisation = true;
  std::vector<Side> sides = {{"scale_normalised", 0.0, DepthScale(normalised)}};
  std::vector<double> sizes = experiment.constant_sizes;
  sizes.insert(sizes.begin(), experiment.standard_size);
  for (const double size : sizes) {
    DepthScaleOptions constant = options;
    constant.scale_normalisation = false;
    constant.constant_size = size;
    const std::string whole = std::to_string(static_cast<int>(std::lround(size)));
    sides.push_back({"constant_" + whole, size, DepthScale(constant)});
  }
  return sides;
}

/// Correct matches of one side, by step.
struct Score {
  std::vector<int> correct = std::vector<int>(kSteps, 0);
  std::vector<int> pairs = std::vector<int>(kSteps, 0);

  void operator+=(const Score& other) {
    for (int s = 0; s < kSteps; ++s) correct[s] += other.correct[s], pairs[s] += other.pairs[s];
  }
  double perPair() const {
    int sum = 0, count = 0;
    for (int s = 0; s < kSteps; ++s) sum += correct[s], count += pairs[s];
    return count ? static_cast<double>(sum) / count : kUnknown;
  }
};

/// What one row of the table is about.
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

struct CaseScores {
  std::vector<Score> of_side;
  double described = 0.0, frames = 0.0;  ///< for the mean size of the feature sets

  void operator+=(const CaseScores& other) {
    of_side.resize(other.of_side.size());
    for (std::size_t s = 0; s < other.of_side.size(); ++s) of_side[s] += other.of_side[s];
    described += other.described;
    frames += other.frames;
  }
};

using Scores = std::map<Case, CaseScores>;

/// Table 1 and figure 7 of the paper, for what it gives.
double publishedImprovement(const Case& c, const std::string& sequence) {
  static const std::map<std::string, double> freak = {{"00", 29.34}, {"01", 18.42}, {"02", 28.81}, {"03", 22.39},
                                                      {"04", 32.25}, {"05", 34.69}, {"06", 28.23}, {"07", 34.64},
                                                      {"08", 36.40}, {"09", 24.53}, {"10", 25.34}};
  static const std::map<std::string, double> sift = {{"00", 10.95}, {"01", 7.65}, {"02", 9.16}, {"03", 6.53},
                                                     {"04", 7.37},  {"05", 9.61}, {"06", 7.04}, {"07", 7.46},
                                                     {"08", 13.05}, {"09", 8.15}, {"10", 7.34}};
  static const std::map<DescriptorType, std::map<std::string, double>> table_1 = {{DescriptorType::kFreak, freak},
                                                                                  {DescriptorType::kSift, sift}};
  static const std::map<int, double> figure_7 = {{310, 11.58}, {1350, 15.37}, {2320, 26.41}};
  if (c.layout != DescriptorLayout::kLeft || c.tolerance != 3.0) return kUnknown;
  if (sequence == "mean") {
    const auto found = figure_7.find(c.features);
    return c.descriptor == DescriptorType::kFreak && found != figure_7.end() ? found->second : kUnknown;
  }
  const auto row = table_1.find(c.descriptor);
  if (c.features != 2320 || row == table_1.end()) return kUnknown;
  const auto found = row->second.find(sequence);
  return found != row->second.end() ? found->second : kUnknown;
}

/// Features of one frame on every side, largest set, with the rows of the smaller sets.
struct DescribedFrame {
  std::vector<StereoFeatures> of_side;
  std::map<int, std::vector<int>> rows_of_count;
};

class SequenceMatching {
 public:
  SequenceMatching(const ReferenceSequence& sequence, const MatchingExperiment& experiment,
                   const ExperimentSetup& setup, const PipelineOptions& options)
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
            const auto& extraction = options_.stereo_features;
            found =
                keypoints.emplace(i, findKeypoints(sequence_.images, i, extraction.detector, extraction.stereo)).first;
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
        for (const double tolerance : experiment_.tolerances) {
          CaseScores& scores = scores_[{experiment_.descriptors[d], layout, count, tolerance}];
          scores.of_side.resize(curves_[d].size());
          scores.described += static_cast<double>(rows.size());
          ++scores.frames;
        }
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
            Score& score = scores_[{descriptor, layout, count, tolerance}].of_side[s];
            score.correct[step] += countCorrect(a, b, matches, motion, tolerance);
            ++score.pairs[step];
          }
        }
      }
    }
  }

  const ReferenceSequence& sequence_;
  const MatchingExperiment& experiment_;
  const PipelineOptions& options_;
  std::vector<std::vector<DepthScale>> curves_;  ///< [descriptor][side]
  std::vector<StereoDescriptor> descriptors_;
  Scores scores_;
};

double improvement(double ours, double theirs) {
  return 100.0 * (ours / theirs - 1.0);
}

/// The improvements of one row: the scale normalised side against the standard one, against the best constant size,
/// and, for the paper's whole descriptor (scale normalised, both views), against the standard one of one view.
struct Improvements {
  double standard = 0.0, best_constant = 0.0, standard_left = 0.0;
};

class Report {
 public:
  Report(const std::vector<Side>& sides, const ExperimentSetup& setup, std::string hash)
      : sides_(sides), reference_(nameOf(setup.reference)), hash_(std::move(hash)) {}

  /// A sequence's row, or the mean's, with the improvements of the sequences.
  void addRow(const std::string& sequence, const Case& c, const Scores& of_sequence,
              const std::vector<Improvements>& of_drives = {}) {
    const CaseScores& scores = of_sequence.at(c);
    std::size_t best = 1;
    for (std::size_t s = 2; s < sides_.size(); ++s)
      if (scores.of_side[s].perPair() > scores.of_side[best].perPair()) best = s;
    const double normalised = scores.of_side[0].perPair(), standard = scores.of_side[1].perPair();
    const auto left = of_sequence.find({c.descriptor, DescriptorLayout::kLeft, c.features, c.tolerance});
    const double standard_left = left == of_sequence.end() ? kUnknown : left->second.of_side[1].perPair();
    const Improvements own{improvement(normalised, standard), improvement(normalised, scores.of_side[best].perPair()),
                           improvement(normalised, standard_left)};
    // As in the paper, the mean improvement is the mean of the sequences' improvements.
    const auto shown = [&](double Improvements::*value) {
      std::vector<double> values;
      for (const Improvements& of_drive : of_drives) values.push_back(of_drive.*value);
      const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
      return std::make_pair(values.empty() ? own.*value : mean, bootstrapMean(values));
    };
    const auto [on_standard, interval] = shown(&Improvements::standard);
    const auto [on_best, interval_on_best] = shown(&Improvements::best_constant);
    const auto [on_left, interval_on_left] = shown(&Improvements::standard_left);
    table_.add(sequence, nameOf(c.descriptor), nameOf(c.layout), c.features, c.tolerance,
               scores.described / std::max(scores.frames, 1.0), normalised, standard, on_standard, interval.low,
               interval.high, publishedImprovement(c, sequence), sides_[best].constant_size,
               scores.of_side[best].perPair(), on_best, interval_on_best.low, interval_on_best.high, on_left,
               interval_on_left.low, interval_on_left.high, reference_, hash_);
    for (std::size_t s = 0; s < sides_.size(); ++s)
      for (int step = 0; step < kSteps; ++step)
        if (const int pairs = scores.of_side[s].pairs[step])
          steps_.add(sequence, nameOf(c.descriptor), nameOf(c.layout), c.features, c.tolerance, sides_[s].name,
                     step + 1, scores.of_side[s].correct[step], pairs);
    latest_ = own;
  }

  const Improvements& latest() const { return latest_; }

  std::string write(const std::string& directory) const {
    table_.write(directory + "/matching.csv");
    steps_.write(directory + "/matching_steps.csv");
    return table_.aligned();
  }

 private:
  const std::vector<Side>& sides_;
  std::string reference_, hash_;
  Improvements latest_;
  CsvTable table_{{"sequence",
                   "descriptor",
                   "layout",
                   "features",
                   "tolerance_px",
                   "described",
                   "scale_normalised",
                   "standard",
                   "improvement_percent",
                   "improvement_low",
                   "improvement_high",
                   "paper_percent",
                   "best_constant_size",
                   "best_constant",
                   "improvement_on_best_percent",
                   "improvement_on_best_low",
                   "improvement_on_best_high",
                   "improvement_on_standard_left_percent",
                   "improvement_on_standard_left_low",
                   "improvement_on_standard_left_high",
                   "reference",
                   "options"}};
  CsvTable steps_{{"sequence", "descriptor", "layout", "features", "tolerance_px", "side", "step", "correct", "pairs"}};
};

}  // namespace

std::string runMatching(const ExperimentSetup& setup, const MatchingExperiment& experiment) {
  PipelineOptions options = setup.options();
  const std::vector<Side> sides = makeSides(setup, DescriptorType::kFreak, experiment);  // their names
  Report report(sides, setup, hashOptions(listOptions(options)));
  Scores total;
  std::map<Case, std::vector<Improvements>> improvements;
  for (const std::string& name : setup.sequences) {
    const ReferenceSequence sequence = openSequence(setup, name, setup.reference);
    const Scores of_sequence = SequenceMatching(sequence, experiment, setup, options).run();
    for (const auto& [c, scores] : of_sequence) {
      report.addRow(sequence.name, c, of_sequence);
      improvements[c].push_back(report.latest());
      total[c] += scores;
    }
  }
  for (const auto& entry : total) report.addRow("mean", entry.first, total, improvements.at(entry.first));
  return report.write(setup.output);
}

}  // namespace sdvo
