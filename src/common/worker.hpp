#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace sdvo {

/// One thread that handles items in order, behind a queue of bounded length: when it is full the oldest item is dropped
/// so that latency cannot grow and callbacks never wait. The handler must not throw.
template <class Item>
class Worker {
 public:
  Worker(std::size_t capacity, std::function<void(const Item&)> handle)
      : capacity_(capacity), handle_(std::move(handle)), thread_([this] { run(); }) {}

  ~Worker() { stop(); }

  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// False where the oldest item had to make room.
  bool push(Item item) {
    bool has_room = true;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      has_room = queue_.size() < capacity_;
      if (!has_room) queue_.pop_front();
      queue_.push_back(std::move(item));
    }
    wake_.notify_one();
    return has_room;
  }

  /// Waits until the handler is done with its item; items in the queue are not handled. An owner whose handler uses
  /// this worker calls it before it destroys the pointer to the worker.
  void stop() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

  /// The next item pushes the oldest one out.
  bool isFull() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return queue_.size() == capacity_;
  }

 private:
  void run() {
    for (;;) {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
      if (stopping_) return;
      const Item item = std::move(queue_.front());
      queue_.pop_front();
      lock.unlock();
      handle_(item);
    }
  }

  const std::size_t capacity_;
  const std::function<void(const Item&)> handle_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Item> queue_;
  bool stopping_ = false;
  std::thread thread_;  // last: it starts when everything else is there
};

/// A request of a service to the thread that handles a stream of items. It applies to items that arrive after the
/// request, not to those that are queued already. A newer request replaces one that was not taken. Thread-safe.
template <class Request>
class Requests {
 public:
  void post(Request request) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++posted_;
    pending_ = std::move(request);
  }

  /// Requests so far: to be noted with each item that arrives.
  int posted() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return posted_;
  }

  /// The request, if it has not been taken and applies to an item: `posted` is posted() when that item arrived. Without
  /// an item, any request.
  std::optional<Request> take(int posted = std::numeric_limits<int>::max()) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (posted < posted_) return std::nullopt;
    return std::exchange(pending_, std::nullopt);
  }

 private:
  mutable std::mutex mutex_;
  std::optional<Request> pending_;
  int posted_ = 0;
};

}  // namespace sdvo
