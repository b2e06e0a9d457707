// Both nodelets in one process, for rosrun: remappings are the process's, private parameters go to the nodelet that has
// an option of that name.
#include <nodelet/loader.h>
#include <ros/ros.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "../config/interface_options.hpp"
#include "params.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry_options.hpp"

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

/// `name`: relative to the process's private namespace. False where no nodelet has such a parameter.
bool handOver(const std::string& name, const XmlRpc::XmlRpcValue& value, const std::vector<Part>& parts) {
  bool is_known = false;
  for (const Part& part : parts) {
    const std::string block = part.name + "/";  // as YAML files have it
    const bool is_in_block = name.compare(0, block.size(), block) == 0;
    const std::string own = is_in_block ? name.substr(block.size()) : name;
    const bool is_of_images = part.name == "stereo_features" && sdvo::isOfImageTransport(name);
    if (!is_in_block && !is_of_images && std::count(part.parameters.begin(), part.parameters.end(), name) == 0)
      continue;
    ros::param::set(block + own, value);  // the nodelet names one that it does not know
    is_known = true;
  }
  return is_known;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "stereo_odometry");
  const ros::NodeHandle private_nh("~");
  const std::vector<Part> parts = makeParts();
  std::vector<std::string> names;
  private_nh.getParamNames(names);
  const std::string prefix = private_nh.getNamespace() + "/";
  for (const std::string& name : names) {
    XmlRpc::XmlRpcValue value;
    if (name.compare(0, prefix.size(), prefix) != 0 || !ros::param::get(name, value)) continue;
    if (!handOver(name.substr(prefix.size()), value, parts))
      ROS_WARN_STREAM("parameter " << name << " is unknown and has no effect: misspelt? See docs/parameters.md");
  }
  nodelet::Loader loader(false);
  for (const Part& part : parts)
    if (!loader.load(ros::names::resolve(part.name), part.type, ros::names::getRemappings(), {})) return EXIT_FAILURE;
  ros::spin();
  return EXIT_SUCCESS;
}
