#pragma once

#include <ros/node_handle.h>

#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

/// Reads each option from the parameter of the same name in `nh`'s namespace; absent ones keep their value. Throws
/// std::invalid_argument naming the parameter when one has the wrong type or is outside its range. Returns the
/// parameters in that namespace that are no option: most likely spelling mistakes.
std::vector<std::string> loadParams(const ros::NodeHandle& nh, std::vector<Option> options);

template <class Options>
std::vector<std::string> loadParams(const ros::NodeHandle& nh, Options& options) {
  return loadParams(nh, listOptions(options));
}

}  // namespace sdvo
