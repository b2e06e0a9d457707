#pragma once

#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include <boost/make_shared.hpp>
#include <cstdint>
#include <exception>
#include <utility>

namespace sdvo {

/// A callback queue with a thread of its own. Nodelets of one manager share its threads: those of others that are slow
/// would let ours wait. An exception that a callback does not catch is reported and ends that call alone, not the
/// process. To be declared before, that is destroyed after, all that has callbacks in it.
class CallbackThread {
 public:
  CallbackThread() : spinner_(1, &queue_) {}
  CallbackThread(const CallbackThread&) = delete;
  CallbackThread& operator=(const CallbackThread&) = delete;

  /// The same node handle, whose callbacks run here.
  ros::NodeHandle serve(ros::NodeHandle nh) {
    nh.setCallbackQueue(&queue_);
    return nh;
  }

  void start() { spinner_.start(); }
  /// Returns when no callback runs any more; none will begin.
  void stop() { spinner_.stop(); }

 private:
  struct Guarded : ros::CallbackInterface {
    explicit Guarded(ros::CallbackInterfacePtr callback) : inner(std::move(callback)) {}
    bool ready() override { return inner->ready(); }
    CallResult call() override try { return inner->call(); } catch (const std::exception& e) {
      ROS_ERROR_STREAM("a message, a service call or a timer was not handled: " << e.what());
      return Success;
    }

    const ros::CallbackInterfacePtr inner;
  };

  struct Queue : ros::CallbackQueue {
    void addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) override {
      ros::CallbackQueue::addCallback(boost::make_shared<Guarded>(callback), owner);
    }
  };

  Queue queue_;
  ros::AsyncSpinner spinner_;
};

}  // namespace sdvo
