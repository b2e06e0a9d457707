#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>

#include <functional>
#include <mutex>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

/// Serves options through dynamic_reconfigure's messages, for dynparam and rqt_reconfigure. Names, ranges, defaults and
/// meanings come from the options themselves; a .cfg file would state each of them a second time.
class ReconfigureServer {
 public:
  /// `options` refer to values that must outlive the server and that only the server writes. `on_change` runs in a ROS
  /// callback after values have changed.
  ReconfigureServer(ros::NodeHandle private_nh, std::vector<Option> options, std::function<void()> on_change);

 private:
  bool onRequest(dynamic_reconfigure::Reconfigure::Request& request,
                 dynamic_reconfigure::Reconfigure::Response& response);
  void set(const std::string& name, const std::string& text);
  dynamic_reconfigure::Config currentConfig() const;

  ros::NodeHandle nh_;
  std::vector<Option> options_;
  std::function<void()> on_change_;
  std::mutex mutex_;
  ros::Publisher descriptions_, updates_;
  ros::ServiceServer service_;
};

}  // namespace sdvo
