#pragma once

#include <cstddef>
#include <cstdint>
#include <set>

namespace sdvo {

/// The stamps (ns) that wait in a synchroniser of equal stamps (message_filters' ExactTime), which has room for so many
/// and makes it by throwing away the earliest. Stamps of the future, and those left over when the clock jumps back,
/// wait for ever: once they take all the room, whatever comes next is the earliest and is thrown away itself.
class WaitingStamps {
 public:
  explicit WaitingStamps(std::size_t capacity) : capacity_(capacity) {}

  /// Notes a message's stamp. Whether those that wait would shut the message out: then the synchroniser must begin
  /// anew, and only this stamp waits. A side that is merely late shuts nothing out.
  bool shutOut(std::int64_t stamp) {
    const bool shut_out = stamps_.size() >= capacity_ && stamp <= *stamps_.begin() - kJump;
    if (shut_out) stamps_.clear();
    stamps_.insert(stamp);
    if (stamps_.size() > capacity_) stamps_.erase(stamps_.begin());
    return shut_out;
  }

  /// All messages of a stamp have come: neither it nor an earlier one waits any more.
  void complete(std::int64_t stamp) { stamps_.erase(stamps_.begin(), stamps_.upper_bound(stamp)); }

 private:
  static constexpr std::int64_t kJump = 1000000000;

  std::size_t capacity_;
  std::set<std::int64_t> stamps_;
};

}  // namespace sdvo
