#pragma once

#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/synchronizer.h>

#include <algorithm>
#include <boost/shared_ptr.hpp>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "../../messages/stamps.hpp"

namespace sdvo {

/// Combines messages of one trigger, one of each input, by equal stamps or the nearest ones within a tolerance.
/// Incomplete sets wait in the order of their arrival. message_filters' ExactTime orders them by stamp: a complete set
/// with a future stamp discards sets that arrive after it, and a queue full of future stamps discards every new
/// message. Not thread-safe.
template <class... Messages>
class TriggerSynchroniser {
 public:
  using Callback = std::function<void(const boost::shared_ptr<const Messages>&...)>;

  /// `capacity`: messages of each input that wait; `tolerance`: s between the stamps of a set. `on_unpaired`, if not
  /// empty, is called with incomplete sets that are given up, null for each missing message.
  TriggerSynchroniser(int capacity, double tolerance, Callback on_set, Callback on_unpaired = {})
      : capacity_(capacity),
        tolerance_(static_cast<std::int64_t>(1e9 * tolerance)),
        on_set_(std::move(on_set)),
        on_unpaired_(std::move(on_unpaired)) {}

  /// Takes a message of the input of this number. Throws std::invalid_argument for a stamp that ROS cannot compare.
  template <int input, class Message>
  void add(const boost::shared_ptr<const Message>& message) {
    const std::string problem = whyUnusable(message->header.stamp);
    if (!problem.empty()) throw std::invalid_argument(problem);
    const std::size_t at = setOf<input>(nanoseconds(message->header.stamp));
    std::get<input>(waiting_[at].messages) = message;
    if (std::apply([](const auto&... all) { return (... && all); }, waiting_[at].messages)) {
      // Each topic is in order: every earlier set has lost a message.
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

  /// Incomplete sets.
  std::size_t waiting() const { return waiting_.size(); }

 private:
  using MessageSet = std::tuple<boost::shared_ptr<const Messages>...>;

  struct Waiting {
    std::int64_t stamp;  ///< of the message that came first, ns
    MessageSet messages;
  };

  /// Index of the set that a message belongs to; a new set if it is the first one.
  template <int input>
  std::size_t setOf(std::int64_t stamp) {
    std::size_t at = waiting_.size();
    std::int64_t nearest = tolerance_ + 1;
    for (std::size_t k = 0; k < waiting_.size(); ++k) {
      const std::int64_t gap = std::abs(waiting_[k].stamp - stamp);
      // A set has this input's message already: only a repeated one of equal stamp replaces it.
      if (gap >= nearest || (gap > 0 && std::get<input>(waiting_[k].messages))) continue;
      nearest = gap;
      at = k;
    }
    if (at == waiting_.size()) waiting_.push_back({stamp, {}});
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
  std::int64_t tolerance_;  ///< ns
  Callback on_set_, on_unpaired_;
  std::deque<Waiting> waiting_;  ///< in the order in which the first message of each came
};

/// Combines messages of the nearest stamps, which differ by up to an interval. Not thread-safe.
template <class... Messages>
class ApproximateSynchroniser {
 public:
  using Callback = std::function<void(const boost::shared_ptr<const Messages>&...)>;

  /// `capacity`: messages of each input that wait; `max_interval`: s.
  ApproximateSynchroniser(int capacity, double max_interval, Callback on_set)
      : policy_(static_cast<std::uint32_t>(capacity)), on_set_(std::move(on_set)) {
    constexpr double kLeastPeriod = 0.01;  // s, of a camera
    policy_.setMaxIntervalDuration(ros::Duration(max_interval));
    // Without a least time between messages of one input each set would wait for the next message, which may be nearer.
    for (int input = 0; input < static_cast<int>(sizeof...(Messages)); ++input)
      policy_.setInterMessageLowerBound(input, ros::Duration(std::min(max_interval, kLeastPeriod)));
    beginAnew();
  }

  template <int input, class Message>
  void add(const boost::shared_ptr<const Message>& message) {
    // After a jump back the policy would keep waiting for partners of messages from before the jump.
    constexpr double kJump = 1.0;  // s, more than messages of one time are apart
    const ros::Time& stamp = message->header.stamp;
    if (secondsBetween(stamp, newest_) > kJump) {
      beginAnew();
      newest_ = stamp;
    }
    newest_ = std::max(newest_, stamp);
    synchroniser_->template add<input>(message);
  }

 private:
  using Policy = message_filters::sync_policies::ApproximateTime<Messages...>;

  void beginAnew() {
    synchroniser_ = std::make_unique<message_filters::Synchronizer<Policy>>(static_cast<const Policy&>(policy_));
    synchroniser_->registerCallback(&ApproximateSynchroniser::onSet, this);
  }

  void onSet(const boost::shared_ptr<const Messages>&... messages) { on_set_(messages...); }

  Policy policy_;
  Callback on_set_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> synchroniser_;
  ros::Time newest_;
};

}  // namespace sdvo
