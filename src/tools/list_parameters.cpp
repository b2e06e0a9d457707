// Prints the parameters of the nodelets as Markdown tables, from the option structs that hold them.
#include <CLI/CLI.hpp>
#include <iostream>
#include <sstream>

#include "../config/pipeline_options.hpp"
#include "run_tool.hpp"

namespace {

std::string rangeOf(const sdvo::Option& option) {
  std::ostringstream text;
  if (std::holds_alternative<bool*>(option.value)) return "true, false";
  for (const std::string& choice : option.choices) text << (text.tellp() > 0 ? ", " : "") << choice;
  if (!option.isText()) text << option.range.min << " … " << option.range.max;
  return text.str();
}

/// Text for a table's cell, where a bar would end it.
std::string cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
  return text;
}

void printTable(const std::string& nodelet, const std::vector<sdvo::Option>& options) {
  const std::string prefix = nodelet + "/";
  std::cout << "| parameter | default | unit | range | meaning |\n| --- | --- | --- | --- | --- |\n";
  for (const sdvo::Option& option : options)
    if (option.name.compare(0, prefix.size(), prefix) == 0)
      std::cout << "| `" << option.name.substr(prefix.size()) << "` | " << option.text() << " | " << option.unit
                << " | " << rangeOf(option) << " | " << cell(option.meaning) << " |\n";
}

int run() {
  sdvo::PipelineOptions core;
  sdvo::InterfaceOptions nodelets;
  std::vector<sdvo::Option> options = sdvo::listOptions(nodelets);
  for (const sdvo::Option& option : sdvo::listOptions(core)) options.push_back(option);

  std::cout
      << "# Parameters\n\nPrivate parameters of the nodelets, made by `rosrun stereo_descriptor_vo "
         "list_parameters > docs/parameters.md` from the\noption structs, the only place where defaults stand.\n\n"
         "## stereo_features\n\n";
  printTable("stereo_features", options);
  std::cout << "\n## visual_odometry\n\n";
  printTable("visual_odometry", options);
  std::cout << "\n## place_recognition\n\n";
  printTable("place_recognition", options);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Prints the nodelets' parameters, defaults, units and ranges as Markdown");
  return sdvo::runTool(app, argc, argv, run);
}
