#include "pipeline_options.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <stdexcept>

namespace sdvo {
namespace {

bool belongsToNodelet(const std::string& path) {
  InterfaceOptions options;
  const std::vector<Option> list = listOptions(options);
  return std::any_of(list.begin(), list.end(), [&](const Option& option) { return option.name == path; });
}

void apply(const YAML::Node& node, const std::string& path, std::vector<Option>& options) {
  if (node.IsMap()) {
    for (const auto& child : node)
      apply(child.second, (path.empty() ? "" : path + "/") + child.first.as<std::string>(), options);
    return;
  }
  if (!belongsToNodelet(path)) setOption(options, path, node.as<std::string>());
}

}  // namespace

PipelineOptions readPipelineOptions(const std::string& yaml_file, const std::vector<std::string>& settings) {
  PipelineOptions options;
  std::vector<Option> list = listOptions(options);
  if (!yaml_file.empty()) try {
      const YAML::Node root = YAML::LoadFile(yaml_file);
      if (!root.IsNull()) apply(root, "", list);
    } catch (const std::exception& e) {
      throw std::runtime_error(yaml_file + ": " + e.what());
    }
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos) throw std::runtime_error("--param " + setting + " is not of the form name=value");
    setOption(list, setting.substr(0, equals), setting.substr(equals + 1));
  }
  return checked(options);
}

}  // namespace sdvo
