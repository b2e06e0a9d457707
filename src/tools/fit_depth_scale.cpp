// Finds the size-from-depth curve of the paper's section 4.1 by sampling: features are followed over pairs, the size at
// which each is most similar to its first view is searched, and curves in disparity are fitted to these samples.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <stdexcept>

#include "../experiments/csv_table.hpp"
#include "../experiments/depth_scale_fit.hpp"
#include "../experiments/plot_script.hpp"
#include "named_choice.hpp"
#include "run_tool.hpp"

namespace {

struct Arguments {
  sdvo::ExperimentSetup setup;
  sdvo::SizeSampling sampling;
  std::string output, plot, model;
  int features = 2320;
  double max_size = 60.0;
};

void writeSamples(const std::string& path, const std::vector<sdvo::SizeSample>& samples) {
  sdvo::CsvTable table({"first_disparity", "disparity", "ratio"});
  for (const sdvo::SizeSample& sample : samples) table.add(sample.first_disparity, sample.disparity, sample.ratio);
  table.write(path);
}

/// The simplest model unless another fits clearly better.
const sdvo::ShapeFit& choose(const std::vector<sdvo::ShapeFit>& fits, const std::string& model) {
  if (!model.empty()) {
    const auto named = std::find_if(fits.begin(), fits.end(), [&](const auto& fit) { return fit.model == model; });
    return *named;
  }
  constexpr double kClearlyBetter = 0.98;  // of the simplest model's robust cost
  const sdvo::ShapeFit* best = &fits.front();
  for (const sdvo::ShapeFit& fit : fits)
    if (fit.robust_cost < kClearlyBetter * best->robust_cost) best = &fit;
  return *best;
}

/// A shape with its factor and smallest size.
struct Choice {
  sdvo::ShapeFit shape;
  sdvo::SlopeTrial trial{0.0, 0.0, 0.0};
};

/// The factor and the smallest size of a shape that match best; all that were tried are added to the table.
Choice tryShape(const std::vector<sdvo::ReferenceSequence>& sequences, const sdvo::PipelineOptions& options,
                const sdvo::ShapeFit& shape, const Arguments& arguments, sdvo::CsvTable& tried) {
  constexpr double kReferenceDisparity = 20.0;  // px
  std::vector<double> slopes;
  for (const double size : {10.0, 12.0, 14.0, 17.0, 20.0, 24.0, 28.0})
    slopes.push_back(size / shape.value(kReferenceDisparity));
  Choice choice{shape, {0.0, 0.0, 0.0}};
  for (const sdvo::SlopeTrial& trial : sdvo::trySlopes(sequences, options, shape, slopes, {8.0, 10.0, 12.0, 14.0},
                                                       arguments.max_size, arguments.features)) {
    tried.add(shape.model, trial.slope, trial.min_size, trial.correct);
    if (trial.correct > choice.trial.correct) choice.trial = trial;
  }
  return choice;
}

void writeYaml(const std::string& path, const Choice& choice, const Arguments& arguments, std::size_t samples) {
  const sdvo::ShapeFit& shape = choice.shape;
  const sdvo::SlopeTrial& best = choice.trial;
  std::ofstream file(path);
  file << "# Written by fit_depth_scale: " << shape.model << " on " << samples << " samples of "
       << arguments.setup.sequences.size() << " sequence(s), median residual " << shape.median_residual << " octaves.\n"
       << "stereo_features:\n"
       << "  size_curve:\n"
       << "    slope: " << best.slope << "\n"
       << "    exponent: " << shape.exponent << "\n"
       << "    offset: " << best.slope * shape.offset << "\n"
       << "    min_size: " << best.min_size << "\n"
       << "    max_size: " << arguments.max_size << "\n";
  if (!file.flush()) throw std::runtime_error("cannot write " + path);
}

int run(const Arguments& arguments) {
  cv::setNumThreads(1);
  const sdvo::PipelineOptions options = arguments.setup.options();
  std::vector<sdvo::ReferenceSequence> sequences;
  std::vector<sdvo::SizeSample> samples;
  for (const std::string& name : arguments.setup.sequences) {
    sequences.push_back(sdvo::openSequence(arguments.setup, name, arguments.setup.reference));
    const auto of_sequence = sdvo::sampleSizes(sequences.back(), options, arguments.sampling);
    samples.insert(samples.end(), of_sequence.begin(), of_sequence.end());
  }

  const std::vector<sdvo::ShapeFit> fits = sdvo::fitShapes(samples);
  sdvo::CsvTable shapes({"model", "exponent", "offset_over_slope", "median_residual_octaves", "robust_cost"});
  for (const sdvo::ShapeFit& fit : fits)
    shapes.add(fit.model, fit.exponent, fit.offset, fit.median_residual, fit.robust_cost);
  const sdvo::ShapeFit& shape = choose(fits, arguments.model);
  std::cout << samples.size() << " samples\n" << shapes.aligned() << "chosen: " << shape.model << "\n";

  // Ratios do not tell the curve's factor: how large a neighbourhood is worth describing shows in matching. Neither do
  // they tell what a shape is worth there, so the simplest one, a fixed circle in the world, competes with the chosen.
  std::vector<sdvo::ShapeFit> candidates = {shape};
  if (arguments.model.empty() && shape.model != fits.front().model) candidates.insert(candidates.begin(), fits.front());
  sdvo::CsvTable tried({"model", "slope", "min_size", "correct_per_pair"});
  Choice choice;
  for (const sdvo::ShapeFit& candidate : candidates) {
    const Choice best = tryShape(sequences, options, candidate, arguments, tried);
    constexpr double kClearlyBetter = 1.005;  // in correct matches; less is within chance
    if (best.trial.correct > kClearlyBetter * choice.trial.correct) choice = best;
  }
  std::cout << tried.aligned();
  writeYaml(arguments.output, choice, arguments, samples.size());
  std::cout << "size = clamp(" << choice.trial.slope << " * disparity^" << choice.shape.exponent << " + "
            << choice.trial.slope * choice.shape.offset << ", " << choice.trial.min_size << ", " << arguments.max_size
            << ") px, written to " << arguments.output << std::endl;

  if (!arguments.plot.empty()) {
    const std::string csv = std::filesystem::path(arguments.plot).replace_extension(".csv").string();
    writeSamples(csv, samples);
    sdvo::runPlotScript("plot_depth_scale.py", {csv, arguments.output, arguments.plot});
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fits the size-from-disparity curve to features followed over sequences in KITTI layout");
  Arguments arguments;
  app.add_option("--sequence", arguments.setup.sequences, "directories in KITTI layout, separated by commas")
      ->required()
      ->delimiter(',');
  app.add_option("--output", arguments.output, "YAML file to write, as the nodelets load it")->required();
  app.add_option("--plot", arguments.plot, "PNG of samples and curve to draw; the samples go to a CSV file beside it");
  sdvo::addChoice(app, "--reference", arguments.setup.reference, "motion taken for true");
  app.add_option("--model", arguments.model, "a*d, a*d+b, a*d^b or a*d^b+c instead of the one that fits best")
      ->check(CLI::IsMember({"a*d", "a*d+b", "a*d^b", "a*d^b+c"}));
  app.add_option("--frames", arguments.setup.frames, "use only the first N pairs of each sequence")
      ->check(CLI::Range(3, 1000000));
  app.add_option("--features", arguments.features, "features of a pair when slopes are tried")
      ->capture_default_str()
      ->check(CLI::Range(50, 10000));
  app.add_option("--max-size", arguments.max_size, "largest key point diameter, px")
      ->capture_default_str()
      ->check(CLI::Range(10.0, 400.0));
  app.add_option("--param", arguments.setup.settings,
                 "option as name=value, for example descriptor/type=sift; repeatable")
      ->allow_extra_args(false);
  return sdvo::runTool(app, argc, argv, [&] { return run(arguments); });
}
