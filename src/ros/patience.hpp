#pragma once

#include <algorithm>

namespace sdvo {

/// How long to wait for what usually comes in a moment: once it did not come in time, not at all for a second, then for
/// two, four and so on up to half a minute, until it is there again. Times in s of a clock that only goes on.
class Patience {
 public:
  explicit Patience(double timeout) : timeout_(timeout) {}

  double timeout(double now) const { return now < rests_until_ ? 0.0 : timeout_; }

  void note(bool came, double now) {
    if (came) {
      rest_ = kShortest;
      rests_until_ = now;
    } else if (now >= rests_until_) {
      rests_until_ = now + rest_;
      rest_ = std::min(2.0 * rest_, kLongest);
    }
  }

 private:
  static constexpr double kShortest = 1.0, kLongest = 30.0;

  double timeout_;
  double rest_ = kShortest, rests_until_ = 0.0;
};

}  // namespace sdvo
