// Finds the size-from-depth curve of the paper's section 4.1 by sampling: features are followed over pairs, the size at
// which each is most similar to its first view is searched, and curves in disparity are fitted to these samples.
#include <filesystem>
#include <iostream>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <sstream>
#include <stdexcept>

#include "../../src/data/text_file.hpp"
#include "../experiments/csv_table.hpp"
#include "../experiments/depth_scale_fit.hpp"
#include "learn.hpp"
#include "named_choice.hpp"

namespace {

struct Arguments {
  sdvo::ExperimentSetup setup;
  sdvo::SizeSampling sampling;
  std::string output, samples, model;
  int features = 2320;
  std::vector<double> sizes = {4.0, 7.0, 10.0, 14.0, 20.0};                    ///< px at a disparity of 20 px
  std::vector<double> min_sizes = {4.0, 7.0, 10.0, 14.0}, max_sizes = {32.0};  ///< px
  std::vector<double> constant_sizes = {5.0, 7.0, 10.0, 14.0};                 ///< px
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

/// Curves of a shape: every factor with every smallest and largest size.
std::vector<sdvo::DepthScaleOptions> curvesOf(const sdvo::ShapeFit& shape, const Arguments& arguments) {
  constexpr double kReferenceDisparity = 20.0;  // px, at which the factor is given as a size
  std::vector<sdvo::DepthScaleOptions> curves;
  for (const double max_size : arguments.max_sizes)
    for (const double min_size : arguments.min_sizes)
      for (const double size : arguments.sizes) {
        if (min_size > max_size) continue;
        sdvo::DepthScaleOptions& curve = curves.emplace_back();
        curve.slope = size / shape.value(kReferenceDisparity);
        curve.exponent = shape.exponent;
        curve.offset = curve.slope * shape.offset;
        curve.min_size = min_size;
        curve.max_size = max_size;
      }
  return curves;
}

/// The same size at every depth.
std::vector<sdvo::DepthScaleOptions> constantCurves(const Arguments& arguments) {
  std::vector<sdvo::DepthScaleOptions> curves;
  for (const double size : arguments.constant_sizes) {
    sdvo::DepthScaleOptions& curve = curves.emplace_back();
    curve.slope = size;
    curve.min_size = curve.max_size = size;
  }
  return curves;
}

void writeYaml(const std::string& path, const sdvo::ShapeFit& shape, const sdvo::DepthScaleOptions& curve,
               const Arguments& arguments, std::size_t samples) {
  std::ostringstream file;
  file << "# Written by learn size-curve: " << shape.model << " on " << samples << " samples of "
       << arguments.setup.sequences.size() << " sequence(s), median residual " << shape.median_residual << " octaves.\n"
       << "stereo_features:\n"
       << "  size_curve:\n"
       << "    slope: " << curve.slope << "\n"
       << "    exponent: " << curve.exponent << "\n"
       << "    offset: " << curve.offset << "\n"
       << "    min_size: " << curve.min_size << "\n"
       << "    max_size: " << curve.max_size << "\n";
  sdvo::writeTextFile(path, file.str());
}

int run(const Arguments& arguments) {
  cv::setNumThreads(1);
  const sdvo::ExperimentOptions options = arguments.setup.options();
  std::vector<sdvo::ReferenceSequence> sequences;
  for (const std::string& name : arguments.setup.sequences)
    sequences.push_back(sdvo::openSequence(arguments.setup, name, arguments.setup.reference));

  // A fixed circle in the world has nothing to fit.
  std::vector<sdvo::SizeSample> samples;
  std::vector<sdvo::ShapeFit> fits(1);
  fits.front().model = "a*d";
  if (arguments.model != fits.front().model) {
    for (const sdvo::ReferenceSequence& sequence : sequences) {
      const auto of_sequence = sdvo::sampleSizes(sequence, options, arguments.sampling);
      samples.insert(samples.end(), of_sequence.begin(), of_sequence.end());
    }
    fits = sdvo::fitShapes(samples);
  }
  sdvo::CsvTable shapes({"model", "exponent", "offset_over_slope", "median_residual_octaves", "robust_cost"});
  for (const sdvo::ShapeFit& fit : fits)
    shapes.add(fit.model, fit.exponent, fit.offset, fit.median_residual, fit.robust_cost);
  const sdvo::ShapeFit& shape = choose(fits, arguments.model);
  std::cout << samples.size() << " samples\n" << shapes.aligned() << "chosen: " << shape.model << "\n";

  // Ratios do not tell the curve's factor: how large a neighbourhood is worth describing shows in matching. Neither do
  // they tell what a shape is worth there: a fixed circle in the world and constant sizes compete with it.
  std::vector<sdvo::DepthScaleOptions> curves = constantCurves(arguments);
  std::vector<const sdvo::ShapeFit*> shape_of(curves.size(), &fits.front());
  std::vector<const sdvo::ShapeFit*> candidates = {&shape};
  if (arguments.model.empty() && &shape != &fits.front()) candidates.insert(candidates.begin(), &fits.front());
  for (const sdvo::ShapeFit* candidate : candidates) {
    const std::vector<sdvo::DepthScaleOptions> of_shape = curvesOf(*candidate, arguments);
    curves.insert(curves.end(), of_shape.begin(), of_shape.end());
    shape_of.resize(curves.size(), candidate);
  }
  const std::vector<sdvo::CurveTrial> trials = sdvo::tryCurves(sequences, options, curves, arguments.features);
  sdvo::CsvTable tried({"model", "slope", "min_size", "max_size", "correct_per_pair", "gain_percent"});
  std::size_t best = 0;
  for (std::size_t k = 0; k < trials.size(); ++k) {
    const auto& [curve, correct, gain] = trials[k];
    const std::string model = k < arguments.constant_sizes.size() ? "constant" : shape_of[k]->model;
    tried.add(model, curve.slope, curve.min_size, curve.max_size, correct, gain);
    // Simpler ones come first: constant sizes, then the fixed circle.
    constexpr double kWithinChance = 0.5;  // % of correct matches
    const bool simpler = shape_of[best] != shape_of[k] ||
                         (best < arguments.constant_sizes.size() && k >= arguments.constant_sizes.size());
    if (gain > trials[best].gain + (simpler ? kWithinChance : 0.0)) best = k;
  }
  const sdvo::DepthScaleOptions& curve = trials[best].curve;
  std::cout << tried.aligned();
  writeYaml(arguments.output, *shape_of[best], curve, arguments, samples.size());
  std::cout << "size = clamp(" << curve.slope << " * disparity^" << curve.exponent << " + " << curve.offset << ", "
            << curve.min_size << ", " << curve.max_size << ") px, " << trials[best].gain
            << " % more correct matches than the standard size, written to " << arguments.output << std::endl;

  if (!arguments.samples.empty()) writeSamples(arguments.samples, samples);
  return 0;
}

}  // namespace

namespace sdvo {

Learning addSizeCurve(CLI::App& app) {
  const auto of_command = std::make_shared<Arguments>();
  Arguments& arguments = *of_command;
  app.add_option("--sequence", arguments.setup.sequences,
                 "directories in KITTI layout, or numbers below --kitti, separated by commas")
      ->required()
      ->delimiter(',');
  app.add_option("--kitti", arguments.setup.kitti, "directory of the KITTI odometry data");
  app.add_option("--output", arguments.output, "YAML file to write, as the nodelets load it")->required();
  app.add_option("--samples", arguments.samples, "CSV file of the samples to write");
  sdvo::addChoice(app, "--reference", arguments.setup.reference, "motion taken for true");
  app.add_option("--model", arguments.model,
                 "a*d, which needs no samples, a*d+b, a*d^b or a*d^b+c instead of the one that fits best")
      ->check(CLI::IsMember({"a*d", "a*d+b", "a*d^b", "a*d^b+c"}));
  app.add_option("--frames", arguments.setup.frames, "use only the first N pairs of each sequence")
      ->check(CLI::Range(3, 1000000));
  app.add_option("--features", arguments.features, "features of a pair when slopes are tried")
      ->capture_default_str()
      ->check(CLI::Range(50, 10000));
  const auto addSizes = [&app](const char* flag, std::vector<double>& sizes, const char* meaning) {
    app.add_option(flag, sizes, meaning)->capture_default_str()->delimiter(',')->check(CLI::Range(2.0, 400.0));
  };
  addSizes("--sizes", arguments.sizes, "factors to try, as sizes at a disparity of 20 px");
  addSizes("--min-sizes", arguments.min_sizes, "smallest key point diameters to try, px");
  addSizes("--max-sizes", arguments.max_sizes, "largest key point diameters to try, px");
  addSizes("--constant-sizes", arguments.constant_sizes, "sizes without depth to try, px");
  app.add_option("--param", arguments.setup.settings,
                 "option as name=value, for example descriptor/type=sift; repeatable")
      ->allow_extra_args(false);
  return [of_command] { return run(*of_command); };
}

}  // namespace sdvo
