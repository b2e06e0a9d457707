#pragma once

#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include <atomic>
#include <boost/make_shared.hpp>
#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "../../common/worker.hpp"

namespace sdvo {

/// Subscriptions that can be paused. To subscribe and to unsubscribe needs the master, which may be out of reach: both
/// happen in a thread of their own.
class PausableInput {
 public:
  using Subscribe = std::function<std::vector<ros::Subscriber>()>;

  /// `before_resume` is called in resume(), before messages come again.
  PausableInput(Subscribe subscribe, std::function<void()> before_resume)
      : subscribe_(std::move(subscribe)),
        before_resume_(std::move(before_resume)),
        subscribers_(subscribe_()),
        worker_(
            1, [this](const bool& wanted) { subscribers_ = wanted ? subscribe_() : std::vector<ros::Subscriber>(); }) {}

  /// False if paused, or not paused, already. Messages may still come for a moment.
  bool pause() { return change(true); }
  bool resume() {
    if (is_paused_) before_resume_();
    return change(false);
  }
  bool isPaused() const { return is_paused_; }

  /// Unsubscribes, too, but is no pause: nothing happens before messages come again, and pauses go on beside it.
  void setResting(bool resting) {
    if (rests_.exchange(resting) != resting) worker_.push(!is_paused_ && !rests_);
  }

 private:
  bool change(bool paused) {
    if (is_paused_.exchange(paused) == paused) return false;
    worker_.push(!is_paused_ && !rests_);
    return true;
  }

  const Subscribe subscribe_;
  const std::function<void()> before_resume_;
  std::vector<ros::Subscriber> subscribers_;  // after the constructor the worker's
  std::atomic<bool> is_paused_{false}, rests_{false};
  Worker<bool> worker_;
};

/// A callback queue with a thread of its own, because nodelets of one manager share its threads, and slow ones delay
/// the others. An exception of a callback is reported and does not end the process. Declare it before (it is destroyed
/// after) everything with callbacks in it.
class CallbackThread {
 public:
  CallbackThread() : spinner_(1, &queue_) {}
  CallbackThread(const CallbackThread&) = delete;
  CallbackThread& operator=(const CallbackThread&) = delete;

  /// The node handle with callbacks in this thread.
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
