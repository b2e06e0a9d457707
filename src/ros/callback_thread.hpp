#pragma once

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

namespace sdvo {

/// A callback queue with a thread of its own. Nodelets of one manager share its threads: those of others that are slow
/// would let ours wait. To be declared before, that is destroyed after, all that has callbacks in it.
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
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_;
};

}  // namespace sdvo
