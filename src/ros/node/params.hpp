#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>

#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "threads.hpp"

namespace sdvo {

/// Reads each option from the parameter of its name in `nh`'s namespace. Missing parameters are set to the option's
/// value, so that the server shows all that are in use. Throws std::invalid_argument that names a parameter of a wrong
/// type or out of range. Returns the parameters that are no option: likely spelling mistakes.
std::vector<std::string> loadParams(const ros::NodeHandle& nh, std::vector<Option> options);

/// Sets a parameter on the server; false if the master does not answer. ros::param::set would wait for the master while
/// it holds a lock that every line on the console needs: the whole process would block.
bool setParam(const ros::NodeHandle& nh, const std::string& name, const XmlRpc::XmlRpcValue& value);

/// Parameter, no option, where the image side writes its input topics for a recorder.
constexpr const char* kInputTopics = "input_topics";

/// Whether a private parameter of the image side belongs to image_transport or its plugins, see StereoImageTransport.
bool isOfImageTransport(const std::string& name);

/// The same for the fields of options structs.
template <class... Options>
std::vector<std::string> loadParams(const ros::NodeHandle& nh, Options&... options) {
  OptionList list;
  (list.collect(options), ...);
  return loadParams(nh, list.options());
}

/// Serves options through dynamic_reconfigure's messages, for dynparam and rqt_reconfigure. Names, ranges, defaults and
/// meanings come from the options themselves; a .cfg file would state each of them a second time.
class ReconfigureServer {
 public:
  /// `options` refer to values that must outlive the server and that only the server writes. `apply` runs in a callback
  /// after values have changed, never twice at a time. If a name or value is wrong, or `apply` throws, the whole
  /// request is rejected: all values stay, and the response has them. Changes are set on the parameter server soon
  /// after. `defaults`: the same options of a default-constructed struct.
  ReconfigureServer(ros::NodeHandle private_nh, std::vector<Option> options, std::function<void()> apply,
                    const std::vector<Option>& defaults);
  /// keeping_ is destroyed before keeper_, whose callback may be using it.
  ~ReconfigureServer() { keeper_.stop(); }

 private:
  bool onRequest(dynamic_reconfigure::Reconfigure::Request& request,
                 dynamic_reconfigure::Reconfigure::Response& response);
  void keep();
  void assign(const dynamic_reconfigure::Config& request);
  void set(const std::string& name, const std::string& text);
  std::vector<std::string> texts() const;
  dynamic_reconfigure::Config currentConfig() const;

  ros::NodeHandle nh_;
  std::vector<Option> options_;
  std::function<void()> apply_;
  std::mutex mutex_;
  std::vector<std::string> kept_;  ///< on the parameter server; the keeper's
  ros::Publisher descriptions_, updates_;
  ros::ServiceServer service_;
  CallbackThread keeper_;
  ros::WallTimer keeping_;  ///< runs while the server lacks something
};

}  // namespace sdvo
