// Prints the parameters of the nodelets as Markdown tables, from the option structs that hold them.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "../config/pipeline_options.hpp"
#include "run_tool.hpp"

namespace {

using namespace sdvo;

std::string rangeOf(const Option& option) {
  std::ostringstream text;
  if (std::holds_alternative<bool*>(option.value)) return "true, false";
  if (std::holds_alternative<std::string*>(option.value)) return "text";
  for (const std::string& choice : option.choices) text << (text.tellp() > 0 ? ", " : "") << choice;
  if (!option.isText()) text << option.range.min << " … " << option.range.max;
  return text.str();
}

/// Text for a table's cell, where a bar would end it.
std::string cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
  return text;
}

/// A parameter that users change early, and the reason to do so.
struct FirstChoice {
  std::string name;  ///< with its nodelet
  std::string when;
};

const FirstChoice kFirstChoices[] = {
    {"visual_odometry/base_frame_id", "the robot's URDF has another name for it, such as base_footprint"},
    {"visual_odometry/odom_frame_id", "several robots share one TF tree"},
    {"visual_odometry/publish_tf", "a filter such as robot_localization publishes odom -> base"},
    {"stereo_features/approximate_sync", "the cameras have no common trigger"},
    {"stereo_features/detector/mask", "parts of the robot are in view"},
    {"stereo_features/detector/max_features", "dropped_pairs grows: fewer need less time"},
    {"stereo_features/max_rate", "the processor is needed for other work, or the camera is very fast"},
    {"stereo_features/queue_size", "every pair of a recording counts: 300, for both nodelets"},
    {"visual_odometry/planar", "the floor is flat and the camera's pitch on TF is right"},
    {"visual_odometry/use_imu", "turns exceed 20 degrees a pair, or the robot starts on a slope"}};

bool isFirstChoice(const Option& option) {
  return std::any_of(std::begin(kFirstChoices), std::end(kFirstChoices),
                     [&](const FirstChoice& choice) { return choice.name == option.name; });
}

/// Default, unit, range and meaning as cells.
std::string cells(const Option& option) {
  return " | " + option.text() + " | " + option.unit + " | " + rangeOf(option) + " | " + cell(option.meaning) + " |";
}

void printFirstChoices(const std::vector<Option>& options) {
  std::cout << "| parameter | nodelet | default | unit | range | meaning | change it when |\n"
               "| --- | --- | --- | --- | --- | --- | --- |\n";
  for (const FirstChoice& choice : kFirstChoices) {
    const auto option =
        std::find_if(options.begin(), options.end(), [&](const Option& o) { return o.name == choice.name; });
    if (option == options.end()) throw std::logic_error("no nodelet has the parameter " + choice.name);
    const std::size_t slash = choice.name.find('/');
    std::cout << "| `" << choice.name.substr(slash + 1) << "` | " << choice.name.substr(0, slash) << cells(*option)
              << " " << choice.when << " |\n";
  }
}

void printTable(const std::string& nodelet, const std::vector<Option>& options) {
  const std::string prefix = nodelet + "/";
  std::cout << "\n## " << nodelet
            << "\n| parameter | default | unit | range | meaning |\n| --- | --- | --- | --- | --- |\n";
  for (const Option& option : options)
    if (option.name.compare(0, prefix.size(), prefix) == 0 && !isFirstChoice(option))
      std::cout << "| `" << option.name.substr(prefix.size()) << "`" << cells(option) << "\n";
}

int run() {
  PipelineOptions core;
  InterfaceOptions nodelets;
  std::vector<Option> options = listOptions(nodelets);
  const auto isListed = [&](const Option& added) {
    return std::any_of(options.begin(), options.end(), [&](const Option& option) { return option.name == added.name; });
  };
  for (const Option& option : listOptions(core))
    if (!isListed(option)) options.push_back(option);

  std::cout << "# Parameters\n\n"
               "Private parameters of the nodelets: first the ten that most users change, then all others. Made by "
               "`rosrun stereo_descriptor_vo list_parameters > docs/parameters.md`.\n\n";
  printFirstChoices(options);
  for (const char* nodelet : {"stereo_features", "visual_odometry", "place_recognition"}) printTable(nodelet, options);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Prints the nodelets' parameters, defaults, units and ranges as Markdown");
  return sdvo::runTool(app, argc, argv, run);
}
