// The paper's experiments (section "Experimental Results") on sequences in KITTI layout, as CSV: sums and single runs,
// without means over drives.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <stdexcept>

#include "../../src/tools/run_tool.hpp"
#include "../experiments/accuracy_experiment.hpp"
#include "../experiments/consensus_experiment.hpp"
#include "../experiments/matching_experiment.hpp"
#include "../experiments/odometry_systems.hpp"
#include "../experiments/robustness_experiment.hpp"
#include "../experiments/scale_experiment.hpp"
#include "named_choice.hpp"

namespace {

struct Arguments {
  sdvo::ExperimentSetup setup;
  sdvo::MatchingExperiment matching;
  sdvo::RobustnessExperiment robustness;
  sdvo::AccuracyExperiment accuracy;
  sdvo::ConsensusExperiment consensus;
  sdvo::ScaleExperiment scale;
};

void addOutput(CLI::App& app, Arguments& arguments) {
  app.add_option("--output", arguments.setup.output, "directory to write to; made when missing")->required();
  app.add_option("--param", arguments.setup.settings,
                 "option as name=value, for example size_curve/slope=0.8; repeatable")
      ->allow_extra_args(false);
}

void addSequences(CLI::App& app, Arguments& arguments) {
  app.add_option("--kitti", arguments.setup.kitti,
                 "directory of the KITTI odometry data, the one that holds sequences/");
  app.add_option("--sequences", arguments.setup.sequences,
                 "numbers such as 04,06, or directories in KITTI layout; separated by commas")
      ->required()
      ->delimiter(',');
  app.add_option("--frames", arguments.setup.frames, "use only the first N pairs of each sequence")
      ->check(CLI::Range(2, 1000000));
  sdvo::addChoice(app, "--setup", arguments.setup.setup, "the nodelets' defaults, or what the paper did");
  addOutput(app, arguments);
}

CLI::App* addMatching(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand("matching", "A: correct matches of scale normalised and standard descriptors");
  addSequences(*command, arguments);
  sdvo::addChoice(*command, "--reference", arguments.setup.reference, "motion taken for true");
  sdvo::addChoices(*command, "--descriptors", arguments.matching.descriptors, "base descriptors, separated by commas");
  sdvo::addChoices(*command, "--layouts", arguments.matching.layouts, "views in a descriptor, separated by commas");
  command->add_option("--features", arguments.matching.feature_counts, "sizes of the feature sets")
      ->capture_default_str()
      ->delimiter(',')
      ->check(CLI::Range(10, 10000));
  command->add_option("--tolerances", arguments.matching.tolerances, "px, within which a match is correct")
      ->capture_default_str()
      ->delimiter(',')
      ->check(CLI::Range(0.1, 20.0));
  command
      ->add_option("--constant-sizes", arguments.matching.constant_sizes,
                   "px, tried for the best constant size beside the standard 7 px")
      ->capture_default_str()
      ->delimiter(',')
      ->check(CLI::Range(2.0, 200.0));
  return command;
}

CLI::App* addRobustness(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand("robustness", "B: inliers of the motion over 1 to 5 steps");
  addSequences(*command, arguments);
  command->add_option("--features", arguments.robustness.features, "size of the feature set")
      ->capture_default_str()
      ->check(CLI::Range(10, 10000));
  command->add_option("--stride", arguments.robustness.stride, "pairs between two starts")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  command->add_option("--seeds", arguments.robustness.seeds, "runs of the outlier rejection")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  return command;
}

CLI::App* addAccuracy(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand("accuracy", "C: errors of the motion over 1 to 5 steps and several seeds");
  addSequences(*command, arguments);
  command->add_option("--features", arguments.accuracy.feature_counts, "sizes of the feature sets")
      ->capture_default_str()
      ->delimiter(',')
      ->check(CLI::Range(10, 10000));
  command->add_option("--seeds", arguments.accuracy.seeds, "runs")->capture_default_str()->check(CLI::Range(1, 1000));
  sdvo::addChoices(*command, "--methods", arguments.accuracy.methods, "outlier rejection, separated by commas");
  std::vector<std::string> systems;
  for (const sdvo::OdometrySystem& system : sdvo::odometrySystems()) systems.push_back(system.name);
  command->add_option("--systems", arguments.accuracy.systems, "what is compared, the standard one among them")
      ->capture_default_str()
      ->delimiter(',')
      ->check(CLI::IsMember(systems));
  command->add_flag("--without-rig-error", arguments.accuracy.without_rig_error,
                    "take out of the disparities what the package's odometry says of the rig's error");
  return command;
}

CLI::App* addConsensus(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand("consensus", "outlier rejection by name on generated correspondences");
  addOutput(*command, arguments);
  command->add_option("--correspondences", arguments.consensus.correspondences, "of each problem")
      ->capture_default_str()
      ->check(CLI::Range(20, 100000));
  command->add_option("--seeds", arguments.consensus.seeds, "problems")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  command->add_option("--budgets", arguments.consensus.budgets, "most samples, separated by commas")
      ->capture_default_str()
      ->delimiter(',')
      ->check(CLI::Range(1, 100000));
  return command;
}

CLI::App* addScaleChange(CLI::App& app, Arguments& arguments) {
  CLI::App* command = app.add_subcommand("scale_change", "correct matches against the change of a feature's scale");
  addSequences(*command, arguments);
  sdvo::addChoice(*command, "--reference", arguments.setup.reference, "motion taken for true");
  command->add_option("--features", arguments.scale.features, "of each view and method")
      ->capture_default_str()
      ->check(CLI::Range(10, 10000));
  command->add_option("--steps", arguments.scale.steps, "pairs between two views, separated by commas")
      ->capture_default_str()
      ->delimiter(',')
      ->check(CLI::Range(1, 1000));
  command->add_option("--stride", arguments.scale.stride, "pairs between two first views")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  return command;
}

/// A line for each: set-up, change and settings with tabs between.
void printAblations() {
  for (const sdvo::Ablation& ablation : sdvo::ablations()) {
    std::cout << sdvo::nameOf(ablation.setup) << "\t" << ablation.change;
    for (const std::string& setting : ablation.settings) std::cout << "\t" << setting;
    std::cout << "\n";
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "The paper's experiments on sequences in KITTI layout: as CSV; lab/run experiments makes tables and figures of "
      "them");
  app.require_subcommand(1);
  Arguments arguments;
  CLI::App* matching = addMatching(app, arguments);
  CLI::App* robustness = addRobustness(app, arguments);
  CLI::App* accuracy = addAccuracy(app, arguments);
  CLI::App* consensus = addConsensus(app, arguments);
  CLI::App* scale_change = addScaleChange(app, arguments);
  CLI::App* ablations = app.add_subcommand("ablations", "lists the set-ups of the ablation and their settings");
  return sdvo::runTool(app, argc, argv, [&] {
    cv::setNumThreads(1);  // experiments are compared with each other: no race may change them
    if (*ablations) {
      printAblations();
      return 0;
    }
    const std::string& output = arguments.setup.output;
    const sdvo::ExperimentOptions options = arguments.setup.options();  // refuses bad settings before the work begins
    std::error_code failure;
    std::filesystem::create_directories(output, failure);
    if (failure) throw std::runtime_error("cannot make the directory " + output + ": " + failure.message());
    if (*matching) {
      sdvo::runMatching(arguments.setup, arguments.matching);
    } else if (*robustness) {
      sdvo::runRobustness(arguments.setup, arguments.robustness);
    } else if (*accuracy) {
      sdvo::runAccuracy(arguments.setup, arguments.accuracy);
    } else if (*scale_change) {
      sdvo::runScaleChange(arguments.setup, arguments.scale);
    } else if (*consensus) {
      arguments.consensus.options = options.visual_odometry.motion;
      sdvo::runConsensus(arguments.consensus, output);
    }
    std::cout << "written to " << output << std::endl;
    return 0;
  });
}
