#pragma once

#include <algorithm>
#include <boost/shared_ptr.hpp>
#include <cstddef>
#include <deque>
#include <functional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "stamps.hpp"

namespace sdvo {

/// Puts messages of equal stamps together, one of each input. Incomplete sets wait in the order of their arrival.
/// message_filters' ExactTime orders them by stamp instead: a complete set with a future stamp discards sets that
/// arrived after it, and a queue full of future stamps discards every new message. Not for several threads at once.
template <class... Messages>
class ExactSynchroniser {
 public:
  using Callback = std::function<void(const boost::shared_ptr<const Messages>&...)>;

  /// `capacity`: messages of each input that wait. `on_unpaired`, unless empty, is told of sets that are given up, null
  /// for what is missing.
  ExactSynchroniser(int capacity, Callback on_set, Callback on_unpaired = {})
      : capacity_(capacity), on_set_(std::move(on_set)), on_unpaired_(std::move(on_unpaired)) {}

  /// Of the input of this number. Throws std::invalid_argument for a stamp that ROS cannot compare.
  template <int input, class Message>
  void add(const boost::shared_ptr<const Message>& message) {
    const std::string problem = whyUnusable(message->header.stamp);
    if (!problem.empty()) throw std::invalid_argument(problem);
    const std::size_t at = setOf(message->header.stamp);
    std::get<input>(waiting_[at].messages) = message;
    if (std::apply([](const auto&... all) { return (... && all); }, waiting_[at].messages)) {
      // Each input keeps its order, so a message of every earlier set was lost.
      for (std::size_t k = 0; k < at; ++k) giveUp(0);
      const MessageSet complete = take(0);
      std::apply(on_set_, complete);
      return;
    }
    const auto has_input = [](const Waiting& set) { return std::get<input>(set.messages) != nullptr; };
    if (std::count_if(waiting_.begin(), waiting_.end(), has_input) > capacity_) {
      const auto first = std::find_if(waiting_.begin(), waiting_.end(), has_input);
      giveUp(static_cast<std::size_t>(first - waiting_.begin()));
    }
  }

 private:
  using MessageSet = std::tuple<boost::shared_ptr<const Messages>...>;

  struct Waiting {
    ros::Time stamp;
    MessageSet messages;
  };

  /// The place of the set with a stamp, which is a new one where nothing of it came before.
  std::size_t setOf(const ros::Time& stamp) {
    const auto found =
        std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& set) { return set.stamp == stamp; });
    const auto at = static_cast<std::size_t>(found - waiting_.begin());
    if (found == waiting_.end()) waiting_.push_back({stamp, {}});
    return at;
  }

  MessageSet take(std::size_t at) {
    const auto set = waiting_.begin() + static_cast<std::ptrdiff_t>(at);
    MessageSet messages = std::move(set->messages);
    waiting_.erase(set);
    return messages;
  }

  void giveUp(std::size_t at) {
    const MessageSet incomplete = take(at);
    if (on_unpaired_) std::apply(on_unpaired_, incomplete);
  }

  std::ptrdiff_t capacity_;
  Callback on_set_, on_unpaired_;
  std::deque<Waiting> waiting_;  ///< in the order in which the first message of each came
};

}  // namespace sdvo
