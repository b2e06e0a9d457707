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

/// Reads each option from the parameter of the same name in `nh`'s namespace; absent ones keep their value and are set,
/// so that the server shows what is in use. Throws std::invalid_argument naming the parameter when one has the wrong
/// type or is outside its range. Returns the parameters in that namespace that are no option: most likely spelling
/// mistakes.
std::vector<std::string> loadParams(const ros::NodeHandle& nh, std::vector<Option> options);

/// On the parameter server; false where the master does not answer. ros::param::set would wait for it with a lock that
/// every line on the console takes, too: the whole process would stand still.
bool setParam(const ros::NodeHandle& nh, const std::string& name, const XmlRpc::XmlRpcValue& value);

/// The image side writes the topics that it reads here, for a recorder. It is no option.
constexpr const char* kInputTopics = "input_topics";

/// Whether image_transport or one of its plugins keeps this parameter beside the image side's, see
/// StereoImageTransport.
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
  /// `options` refer to values that must outlive the server and that only the server writes. `apply` runs in a ROS
  /// callback, never twice at a time, after values have changed. A request is taken over as a whole or not at all: when
  /// a name or a value is wrong, or `apply` throws, all values are as before and the response shows these.
  /// What has changed is set on the parameter server soon after. `defaults`: the same options of a struct left as it
  /// is.
  ReconfigureServer(ros::NodeHandle private_nh, std::vector<Option> options, std::function<void()> apply,
                    const std::vector<Option>& defaults);
  /// The keeper's callback may be about to stop its timer, which is destroyed first.
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
