#include "pipeline_options.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace sdvo {
namespace {

/// Whether a name in the YAML file is an option of the nodelets alone, which the launch files use.
bool belongsToNodelet(const std::string& path) {
  constexpr std::string_view kTransport = "/image_transport";  // of image_transport itself
  if (path.size() > kTransport.size() && path.compare(path.size() - kTransport.size(), path.npos, kTransport) == 0)
    return true;
  InterfaceOptions options;
  const std::vector<Option> list = listOptions(options);
  return std::any_of(list.begin(), list.end(), [&](const Option& option) { return option.name == path; });
}

/// Booleans as ROS reads them: YAML 1.1 has more than true and false.
std::string textOf(const YAML::Node& scalar) {
  const std::string text = scalar.as<std::string>();
  const bool is_quoted = scalar.Tag() == "!";
  bool value = false;
  if (is_quoted || text.size() < 2 || !YAML::convert<bool>::decode(scalar, value)) return text;
  return value ? "true" : "false";
}

void apply(const YAML::Node& node, const std::string& path, std::vector<Option>& options) {
  if (node.IsMap()) {
    for (const auto& child : node)
      apply(child.second, (path.empty() ? "" : path + "/") + child.first.as<std::string>(), options);
    return;
  }
  if (node.IsNull()) return;  // left empty: as launch/copy_config.py has it, it is not there
  const bool is_known =
      std::any_of(options.begin(), options.end(), [&](const Option& option) { return option.name == path; });
  if (is_known || !belongsToNodelet(path)) setOption(options, path, textOf(node));
}

}  // namespace

PipelineOptions readPipelineOptions(const std::string& yaml_file, const std::vector<std::string>& settings) {
  PipelineOptions options;
  std::vector<Option> list = listOptions(options);
  constexpr std::uintmax_t kLargest = 1'000'000;  // bytes, as of launch/copy_config.py
  if (!yaml_file.empty()) try {
      if (!std::filesystem::is_regular_file(yaml_file)) throw std::invalid_argument("it is no file");
      if (std::filesystem::file_size(yaml_file) > kLargest) throw std::invalid_argument("it is too large for options");
      apply(YAML::LoadFile(yaml_file), "", list);
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
