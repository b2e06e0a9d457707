#pragma once

#include <mutex>
#include <optional>
#include <utility>

namespace sdvo {

/// What a service asks of the thread that handles a stream of items: it holds for items that arrive after the request,
/// not for those that wait in a queue already. The newest request wins. For any thread.
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

  /// The request that holds for an item and has not been taken; `posted` as noted when that arrived.
  std::optional<Request> take(int posted) {
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
