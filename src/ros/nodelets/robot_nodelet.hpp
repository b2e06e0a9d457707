#pragma once

#include <nodelet/nodelet.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>

#include <exception>
#include <functional>
#include <list>
#include <string>
#include <vector>

#include "../../check/input_monitor.hpp"
#include "../node/params.hpp"
#include "../node/threads.hpp"
#include "../node/throttles.hpp"

/// Report in a RobotNodelet, at most once in 5 s for each `kind`. Macros, so that rosout has the caller's file and
/// line.
#define SDVO_WARN(kind, ...) \
  if (throttle_.allows(kind)) NODELET_WARN_STREAM(__VA_ARGS__)
#define SDVO_ERROR(kind, ...) \
  if (throttle_.allows(kind)) NODELET_ERROR_STREAM(__VA_ARGS__)

namespace sdvo {

/// Base of this package's nodelets: callbacks in threads of their own, a start that fails as a whole, services, and
/// reports that do not repeat within seconds.
class RobotNodelet : public nodelet::Nodelet {
 protected:
  /// The nodelet's onInit(). Callbacks begin once it has returned. An exception is the reason of a failed start.
  virtual void begin() = 0;

  /// A callback queue with a thread of its own. Only for begin().
  CallbackThread& addThread() { return threads_.emplace_back(); }

  /// For the destructor of the derived class: nothing may arrive any more, and nothing be in work, when members go.
  void stopThreads() {
    for (CallbackThread& thread : threads_) thread.stop();
  }

  /// Private parameters into the fields of options structs.
  template <class... Options>
  void loadOptions(const ros::NodeHandle& private_nh, Options&... options) {
    for (const std::string& name : loadParams(private_nh, options...))
      NODELET_WARN_STREAM("parameter " << name << " is unknown and has no effect: misspelt? See docs/parameters.md");
  }

  /// A service that succeeds unless `work` throws. The exception's text becomes the response's message.
  template <class Service, class Work>
  void serve(ros::NodeHandle& nh, const std::string& name, Work work) {
    using Request = typename Service::Request;
    using Response = typename Service::Response;
    const boost::function<bool(Request&, Response&)> callback = [work](Request& request, Response& response) {
      try {
        work(request, response);
        response.success = true;
      } catch (const std::exception& e) {
        response.message = e.what();
      }
      return true;
    };
    services_.push_back(nh.advertiseService(name, callback));
  }

  /// The service "reset", which cannot fail.
  void serveReset(ros::NodeHandle& nh, const std::function<void()>& work) {
    using Empty = std_srvs::Empty;
    const boost::function<bool(Empty::Request&, Empty::Response&)> callback = [work](auto&, auto&) {
      work();
      return true;
    };
    services_.push_back(nh.advertiseService("reset", callback));
  }

  /// The services "pause" and "resume" of an input, whose silence meanwhile is no fault. `gap`: what resuming costs.
  void servePauses(ros::NodeHandle& nh, PausableInput& input, InputMonitor& monitor, const std::string& gap) {
    serve<std_srvs::Trigger>(nh, "pause", [&](const auto&, auto& response) {
      response.message = input.pause() ? "paused" : "was paused already";
      monitor.noteIdle("paused");
    });
    serve<std_srvs::Trigger>(nh, "resume", [&, gap](const auto&, auto& response) {
      const bool resumed = input.resume();
      response.message = resumed ? "resumed; " + gap : "was not paused";
      if (resumed) monitor.noteIdle("");
    });
  }

  ReportThrottle throttle_;  ///< for SDVO_WARN and SDVO_ERROR

 private:
  void onInit() final try {
    begin();
    for (CallbackThread& thread : threads_) thread.start();
  } catch (const std::exception& e) {
    NODELET_FATAL_STREAM("not started: " << e.what());
    throw;  // the manager forgets the nodelet, and its loader ends with an error
  }

  std::list<CallbackThread> threads_;
  std::vector<ros::ServiceServer> services_;
};

}  // namespace sdvo
