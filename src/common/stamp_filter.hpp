#pragma once

#include <cstdint>
#include <cstdlib>
#include <optional>
#include <utility>
#include <vector>

namespace sdvo {

/// Keeps a stream of stamped items in order. An item that is late by less than a second is dropped. A larger jump, back
/// or ahead, is believed at once if the clock jumped too (a bag started again, a camera paused) or the source announced
/// it. Otherwise the item is held until the next one. If that continues from the held item, both pass; else the held
/// one was an outlier and is dropped. Stamps and times in ns.
template <class Item>
class StampFilter {
 public:
  struct Passed {
    Item item;
    int source_restarts;  ///< one more after every jump back that the clock did not make: a driver that restarts
    int clock_steps;      ///< one more after every jump back that the clock made, too
  };

  /// `now` is the clock's time at the item's arrival. Returns what may be processed, in order: usually the item itself.
  std::vector<Passed> add(Item item, std::int64_t stamp, std::int64_t now, bool announced = false) {
    const Arrival arrival{stamp, now};
    // When a bag starts again, either the clock or the first stamp may be seen to jump first.
    if (last_now_ && now < *last_now_) fell_to_ = now;
    last_now_ = now;
    if (!last_) return {pass(std::move(item), arrival)};
    const std::int64_t step = stamp - last_->stamp;
    if (step > 0 && step <= kJump) {
      if (fell_to_ && now - *fell_to_ > kJump) fell_to_.reset();  // the clock was set back: no stamp followed in time
      dropHeld();
      return {pass(std::move(item), arrival)};
    }
    if (held_ && goesOn(held_->second, arrival)) {
      std::vector<Passed> both;
      both.push_back(pass(std::move(held_->first), held_->second));
      held_.reset();
      both.push_back(pass(std::move(item), arrival));
      return both;
    }
    const bool clock_jumped_back = step <= 0 && now < last_->now;
    if (announced || ((clock_jumped_back || std::llabs(step) >= kJump) && movedWithClock(*last_, arrival))) {
      dropHeld();
      return {pass(std::move(item), arrival)};
    }
    if (step <= 0 && step > -kJump) {
      ++dropped_;
      return {};
    }
    if (held_) ++dropped_;
    held_.emplace(std::move(item), arrival);
    return {};
  }

  /// Late items and outliers so far.
  std::uint64_t dropped() const { return dropped_; }

 private:
  struct Arrival {
    std::int64_t stamp, now;
  };

  static constexpr std::int64_t kJump = 1000000000;

  static bool movedWithClock(const Arrival& from, const Arrival& to) {
    return std::llabs((to.stamp - from.stamp) - (to.now - from.now)) < kJump;
  }

  static bool goesOn(const Arrival& from, const Arrival& to) {
    return to.stamp > from.stamp && (to.stamp - from.stamp <= kJump || movedWithClock(from, to));
  }

  Passed pass(Item item, const Arrival& arrival) {
    if (last_ && arrival.stamp <= last_->stamp)
      ++(std::exchange(fell_to_, std::nullopt) ? clock_steps_ : source_restarts_);
    last_ = arrival;
    return {std::move(item), source_restarts_, clock_steps_};
  }

  void dropHeld() {
    if (held_) ++dropped_;
    held_.reset();
  }

  std::optional<Arrival> last_;
  std::optional<std::pair<Item, Arrival>> held_;
  std::optional<std::int64_t> last_now_;
  std::optional<std::int64_t> fell_to_;  ///< the clock's time after it jumped back, until the stamps do so
  int source_restarts_ = 0, clock_steps_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace sdvo
