#pragma once

#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "stamps.hpp"
#include "waiting_stamps.hpp"

namespace sdvo {

/// message_filters' synchroniser of equal stamps, which begins anew where stamps that wait for ever would shut out
/// whatever comes next (WaitingStamps). One thread calls it.
template <class... Messages>
class ExactSynchroniser {
 public:
  using Callback = std::function<void(const boost::shared_ptr<const Messages>&...)>;

  /// `capacity`: sets that wait. `on_unpaired`, unless empty, is told of sets that are given up, null for what is
  /// missing.
  ExactSynchroniser(int capacity, Callback on_set, Callback on_unpaired = {})
      : capacity_(static_cast<std::uint32_t>(capacity)),
        on_set_(std::move(on_set)),
        on_unpaired_(std::move(on_unpaired)),
        waiting_(static_cast<std::size_t>(capacity)) {
    begin();
  }

  /// Of the input of this number. Throws std::invalid_argument for a stamp that ROS cannot compare.
  template <int input, class Message>
  void add(const boost::shared_ptr<const Message>& message) {
    const ros::Time& stamp = message->header.stamp;
    const std::string problem = whyUnusable(stamp);
    if (!problem.empty()) throw std::invalid_argument(problem);
    if (waiting_.shutOut(nanoseconds(stamp))) begin();
    synchroniser_->template add<input>(message);
  }

 private:
  using Policy = message_filters::sync_policies::ExactTime<Messages...>;

  /// What waited is forgotten.
  void begin() {
    synchroniser_ = std::make_unique<message_filters::Synchronizer<Policy>>(Policy(capacity_));
    synchroniser_->registerCallback(&ExactSynchroniser::onSet, this);
    if (on_unpaired_) synchroniser_->registerDropCallback(&ExactSynchroniser::onUnpaired, this);
  }

  void onSet(const boost::shared_ptr<const Messages>&... messages) {
    waiting_.complete(nanoseconds(std::get<0>(std::tie(messages...))->header.stamp));
    on_set_(messages...);
  }

  void onUnpaired(const boost::shared_ptr<const Messages>&... messages) { on_unpaired_(messages...); }

  std::uint32_t capacity_;
  Callback on_set_, on_unpaired_;
  WaitingStamps waiting_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> synchroniser_;
};

}  // namespace sdvo
