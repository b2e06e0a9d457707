// Both nodelets in one process, for rosrun: remappings are the process's, private parameters go to the nodelet that has
// an option of that name.
#include <nodelet/loader.h>
#include <ros/ros.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "../../config/interface_options.hpp"
#include "../node/params.hpp"
#include "../node/signals.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace {

struct Part {
  std::string name, type;
  std::vector<std::string> parameters;
};

template <class... Options>
Part makePart(const std::string& name, const std::string& type, Options... options) {
  std::vector<std::string> parameters;
  const auto add = [&](auto& component) {
    for (const sdvo::Option& option : sdvo::listOptions(component)) parameters.push_back(option.name);
  };
  (add(options), ...);
  return {name, "stereo_descriptor_vo/" + type, parameters};
}

std::vector<Part> makeParts() {
  return {makePart("stereo_features", "StereoFeatures", sdvo::StereoInputOptions(), sdvo::FeatureExtractorOptions()),
          makePart("visual_odometry", "VisualOdometry", sdvo::OdometryOutputOptions(), sdvo::VisualOdometryOptions())};
}

/// `name`: relative to the process's private namespace. Returns the parameters of nodelets that have it now.
std::vector<std::string> handOver(const std::string& name, const XmlRpc::XmlRpcValue& value,
                                  const std::vector<Part>& parts) {
  std::vector<std::string> given;
  for (const Part& part : parts) {
    const std::string block = part.name + "/";  // as YAML files have it
    const bool is_in_block = name.compare(0, block.size(), block) == 0;
    const std::string own = is_in_block ? name.substr(block.size()) : name;
    const bool is_of_images = part.name == "stereo_features" && sdvo::isOfImageTransport(name);
    if (!is_in_block && !is_of_images && std::count(part.parameters.begin(), part.parameters.end(), name) == 0)
      continue;
    ros::param::set(block + own, value);  // if it is unknown, the nodelet warns
    given.push_back(ros::names::resolve(block + own));
  }
  return given;
}

/// Once ROS has shut down here, too: options end with the process that they were given to.
void forget(const std::string& parameter) {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  request[1] = parameter;
  ros::master::execute("deleteParam", request, response, payload, false);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  ros::init(argc, argv, "stereo_odometry");
  const ros::NodeHandle private_nh("~");
  sdvo::endAsBySigint();  // what follows ros::spin() happens after any of them
  std::vector<std::string> mine;  // parameters that nobody else gave
  for (const std::string& argument : arguments)
    if (argument.find(":=") != std::string::npos && argument[0] == '_' && argument[1] != '_')
      mine.push_back(private_nh.resolveName(argument.substr(1, argument.find(":=") - 1)));
  const std::vector<Part> parts = makeParts();
  std::vector<std::string> names;
  private_nh.getParamNames(names);
  const std::string prefix = private_nh.getNamespace() + "/";
  for (const std::string& name : names) {
    XmlRpc::XmlRpcValue value;
    if (name.compare(0, prefix.size(), prefix) != 0 || !ros::param::get(name, value)) continue;
    const std::vector<std::string> given = handOver(name.substr(prefix.size()), value, parts);
    mine.insert(mine.end(), given.begin(), given.end());
    if (given.empty())
      ROS_WARN_STREAM("parameter " << name << " is unknown and has no effect: misspelt? See docs/parameters.md");
  }
  nodelet::Loader loader(false);
  for (const Part& part : parts)
    if (!loader.load(ros::names::resolve(part.name), part.type, ros::names::getRemappings(), {})) return EXIT_FAILURE;
  ros::spin();
  for (const std::string& parameter : mine) forget(parameter);
  return EXIT_SUCCESS;
}
