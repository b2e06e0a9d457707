#include "params.hpp"

#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/config_tools.h>
#include <ros/master.h>
#include <ros/this_node.h>

#include <algorithm>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "../../common/text.hpp"

namespace sdvo {
namespace {

/// With all digits of a double. Like numberOf() in the C locale, for another nodelet may have set one of the process.
std::string textOf(double number) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(17);
  text << number;
  return text.str();
}

double numberOf(const std::string& text) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double number = 0.0;
  stream >> number;
  return number;
}

/// By the parameter's text, for YAML takes `5e0` for text and `2.0` for a double.
void assign(const XmlRpc::XmlRpcValue& parameter, Option& option) {
  using Value = XmlRpc::XmlRpcValue;
  Value value = parameter;  // its conversions are not const
  switch (value.getType()) {
    case Value::TypeBoolean:
      return option.set(static_cast<bool&>(value) ? "true" : "false");
    case Value::TypeInt:
      return option.set(std::to_string(static_cast<int&>(value)));
    case Value::TypeDouble:
      return option.set(textOf(static_cast<double&>(value)));
    case Value::TypeString:
      return option.set(static_cast<std::string&>(value));
    default:
      throw std::invalid_argument(option.name + " is a list or a block: one value is expected");
  }
}

/// Calls `use` with the value of this text in the option's type: bool, int, double or std::string.
template <class Use>
auto withValue(const Option& option, const std::string& text, const Use& use) {
  if (std::holds_alternative<bool*>(option.value)) return use(text == "true");
  if (std::holds_alternative<int*>(option.value)) return use(std::stoi(text));
  if (std::holds_alternative<double*>(option.value)) return use(numberOf(text));
  return use(text);
}

XmlRpc::XmlRpcValue valueOf(const Option& option, const std::string& text) {
  return withValue(option, text, [](const auto& value) { return XmlRpc::XmlRpcValue(value); });
}

}  // namespace

bool setParam(const ros::NodeHandle& nh, const std::string& name, const XmlRpc::XmlRpcValue& value) {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  request[1] = nh.resolveName(name);
  request[2] = value;
  return ros::master::execute("setParam", request, response, payload, false);
}

bool isOfImageTransport(const std::string& name) {
  const auto beginsWith = [&](const std::string& side) { return name.compare(0, side.size(), side) == 0; };
  return name == "image_transport" || beginsWith("left_image/") || beginsWith("right_image/");
}

std::vector<std::string> loadParams(const ros::NodeHandle& nh, std::vector<Option> options) {
  for (Option& option : options) {
    XmlRpc::XmlRpcValue value;
    if (!nh.getParam(option.name, value)) {
      setParam(nh, option.name, valueOf(option, option.text()));
      continue;
    }
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
    if (isOfImageTransport(relative) || relative == kInputTopics) continue;
    const bool known = std::any_of(options.begin(), options.end(), [&](const Option& o) { return o.name == relative; });
    if (!known) unknown.push_back(name);
  }
  return unknown;
}

namespace {

using dynamic_reconfigure::Config;

const ros::WallDuration kKeepPeriod(0.2);  // s (chosen), between attempts to set parameters

std::string groupOf(const Option& option) {
  const std::size_t slash = option.name.rfind('/');
  return slash == std::string::npos ? "Default" : option.name.substr(0, slash);
}

/// A group for each component. The first group, for options of none, always exists.
std::vector<dynamic_reconfigure::GroupState> groupsOf(const std::vector<Option>& options) {
  std::vector<dynamic_reconfigure::GroupState> groups;
  const auto add = [&](const std::string& name) {
    if (std::any_of(groups.begin(), groups.end(), [&](const auto& group) { return group.name == name; })) return;
    groups.emplace_back();
    groups.back().name = name;
    groups.back().state = true;
    groups.back().id = static_cast<int>(groups.size()) - 1;
  };
  add("Default");
  for (const Option& option : options) add(groupOf(option));
  return groups;
}

void add(Config& config, const Option& option, const std::string& text) {
  withValue(option, text,
            [&](const auto& value) { dynamic_reconfigure::ConfigTools::appendParameter(config, option.name, value); });
}

/// The limits that dynamic_reconfigure states for every parameter, also where there are none.
void addLimits(Config& min, Config& max, const Option& option) {
  const bool is_bool = std::holds_alternative<bool*>(option.value);
  add(min, option, is_bool ? "false" : option.isText() ? "" : textOf(option.range.min));
  add(max, option, is_bool ? "true" : option.isText() ? "" : textOf(option.range.max));
}

const char* typeName(const Option& option) {
  constexpr const char* kNames[] = {"bool", "int", "double", "str", "str"};  // in the order of Option::value
  return kNames[option.value.index()];
}

/// The list to choose from, in the form of a Python literal that rqt_reconfigure reads.
std::string editMethod(const Option& option) {
  if (option.choices.empty()) return "";
  std::string entries;
  for (const std::string& choice : option.choices)
    entries +=
        (entries.empty() ? "" : ", ") + ("{'name': '" + choice + "', 'value': '" + choice + "', 'type': 'str', ") +
        "'description': '', 'srcline': 0, 'srcfile': '', 'ctype': 'std::string', 'cconsttype': 'const char * const'}";
  return "{'enum_description': '', 'enum': [" + entries + "]}";
}

}  // namespace

ReconfigureServer::ReconfigureServer(ros::NodeHandle private_nh, std::vector<Option> options,
                                     std::function<void()> apply, const std::vector<Option>& defaults)
    : nh_(std::move(private_nh)), options_(std::move(options)), apply_(std::move(apply)), kept_(texts()) {
  dynamic_reconfigure::ConfigDescription description;
  for (const dynamic_reconfigure::GroupState& state : groupsOf(options_)) {
    description.groups.emplace_back();
    description.groups.back().name = state.name;
    description.groups.back().id = state.id;
  }
  for (const Option& option : options_) {
    dynamic_reconfigure::ParamDescription parameter;
    parameter.name = option.name;
    parameter.type = typeName(option);
    parameter.description = option.meaning + (option.unit.empty() ? "" : " [" + option.unit + "]");
    parameter.edit_method = editMethod(option);
    std::find_if(description.groups.begin(), description.groups.end(), [&](const auto& group) {
      return group.name == groupOf(option);
    })->parameters.push_back(parameter);
    addLimits(description.min, description.max, option);
  }
  for (const Option& option : defaults) add(description.dflt, option, option.text());
  for (Config* config : {&description.dflt, &description.min, &description.max}) config->groups = groupsOf(options_);

  descriptions_ = nh_.advertise<dynamic_reconfigure::ConfigDescription>("parameter_descriptions", 1, true);
  updates_ = nh_.advertise<Config>("parameter_updates", 1, true);
  descriptions_.publish(description);
  updates_.publish(currentConfig());
  keeping_ = keeper_.serve(nh_).createWallTimer(
      kKeepPeriod, [this](const ros::WallTimerEvent&) { keep(); }, false, false);
  keeper_.start();
  service_ = nh_.advertiseService("set_parameters", &ReconfigureServer::onRequest, this);
}

bool ReconfigureServer::onRequest(dynamic_reconfigure::Reconfigure::Request& request,
                                  dynamic_reconfigure::Reconfigure::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::vector<std::string> before = texts();
  try {
    assign(request.config);
    if (texts() != before) apply_();
    keeping_.start();
  } catch (const std::exception& e) {
    for (std::size_t i = 0; i < options_.size(); ++i) options_[i].set(before[i]);
    ROS_WARN_STREAM(nh_.getNamespace() << ": nothing reconfigured, all values stay: " << e.what());
  }
  response.config = currentConfig();
  updates_.publish(response.config);
  return true;
}

/// Sets changed values on the parameter server, for rosparam and for a nodelet that is loaded again. Runs in a thread
/// of its own until the master has them all.
void ReconfigureServer::keep() {
  std::unique_lock<std::mutex> lock(mutex_);
  const std::vector<std::string> wanted = texts();
  lock.unlock();
  for (std::size_t i = 0; i < options_.size(); ++i)
    if (kept_[i] != wanted[i] && setParam(nh_, options_[i].name, valueOf(options_[i], wanted[i]))) kept_[i] = wanted[i];
  lock.lock();
  if (kept_ == texts()) keeping_.stop();
}

void ReconfigureServer::assign(const Config& request) {
  for (const auto& parameter : request.bools) set(parameter.name, parameter.value ? "true" : "false");
  for (const auto& parameter : request.ints) set(parameter.name, std::to_string(parameter.value));
  for (const auto& parameter : request.strs) set(parameter.name, parameter.value);
  for (const auto& parameter : request.doubles) set(parameter.name, textOf(parameter.value));
}

void ReconfigureServer::set(const std::string& name, const std::string& text) {
  const auto option = std::find_if(options_.begin(), options_.end(), [&](const Option& o) { return o.name == name; });
  if (option == options_.end())
    throw std::invalid_argument("there is no option '" + name + "': list_parameters prints all");
  option->set(text);
  if (option->clamp())
    ROS_WARN_STREAM(nh_.getNamespace() << "/" << name << " = " << text << " is outside of its range, the nearest value "
                                       << option->text() << " is used");
  option->check();
}

std::vector<std::string> ReconfigureServer::texts() const {
  std::vector<std::string> texts;
  for (const Option& option : options_) texts.push_back(option.text());
  return texts;
}

Config ReconfigureServer::currentConfig() const {
  Config config;
  for (const Option& option : options_) add(config, option, option.text());
  config.groups = groupsOf(options_);
  return config;
}

}  // namespace sdvo
