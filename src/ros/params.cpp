#include "params.hpp"

#include <algorithm>
#include <stdexcept>

namespace sdvo {
namespace {

void assign(const XmlRpc::XmlRpcValue& parameter, Option& option) {
  using Value = XmlRpc::XmlRpcValue;
  Value value = parameter;  // its conversions are not const
  const auto wrongType = [&](const char* wanted) { return std::invalid_argument(option.name + " is not " + wanted); };
  if (auto* b = std::get_if<bool*>(&option.value)) {
    if (value.getType() != Value::TypeBoolean) throw wrongType("a boolean");
    **b = static_cast<bool&>(value);
  } else if (auto* i = std::get_if<int*>(&option.value)) {
    if (value.getType() != Value::TypeInt) throw wrongType("an integer");
    **i = static_cast<int&>(value);
  } else if (auto* d = std::get_if<double*>(&option.value)) {
    if (value.getType() != Value::TypeDouble && value.getType() != Value::TypeInt) throw wrongType("a number");
    **d = value.getType() == Value::TypeInt ? static_cast<int&>(value) : static_cast<double&>(value);
  } else {
    if (value.getType() != Value::TypeString) throw wrongType("a string");
    option.set(static_cast<std::string&>(value));
  }
}

/// What image_transport and its plugins keep under the same private namespace, see StereoImageTransport.
bool isOfImageTransport(const std::string& name) {
  const auto beginsWith = [&](const std::string& side) { return name.compare(0, side.size(), side) == 0; };
  return name == "image_transport" || beginsWith("left_image/") || beginsWith("right_image/");
}

}  // namespace

std::vector<std::string> loadParams(const ros::NodeHandle& nh, std::vector<Option> options) {
  for (Option& option : options) {
    XmlRpc::XmlRpcValue value;
    if (!nh.getParam(option.name, value)) continue;
    try {
      assign(value, option);
      option.check();
    } catch (const std::invalid_argument& e) {
      throw std::invalid_argument("parameter " + nh.getNamespace() + "/" + e.what());
    }
  }

  std::vector<std::string> names, unknown;
  nh.getParamNames(names);
  const std::string prefix = nh.getNamespace() + "/";
  for (const std::string& name : names) {
    if (name.compare(0, prefix.size(), prefix) != 0) continue;
    const std::string relative = name.substr(prefix.size());
    if (isOfImageTransport(relative)) continue;
    const bool known = std::any_of(options.begin(), options.end(), [&](const Option& o) { return o.name == relative; });
    if (!known) unknown.push_back(name);
  }
  return unknown;
}

}  // namespace sdvo
