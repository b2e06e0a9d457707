#pragma once

#include <ros/time.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <map>
#include <mutex>
#include <sstream>
#include <string>

namespace sdvo {

/// Limits a rate by stamps. An item passes from 95 % of a period after the last one that passed: otherwise jitter at
/// exactly twice the rate would let every third item pass instead of every second one.
class Pace {
 public:
  /// `max_rate`: Hz; 0: no limit.
  explicit Pace(double max_rate) : period_(max_rate > 0.0 ? static_cast<std::int64_t>(1e9 / max_rate) : 0) {}

  /// Whether the item of this stamp (ns) passes. Where the stamp is not later than the last one, it passes.
  bool isDue(std::int64_t stamp) {
    if (has_begun_ && stamp > last_ && stamp - last_ < period_ - period_ / 20) return false;
    has_begun_ = true;
    last_ = stamp;
    return true;
  }

 private:
  std::int64_t period_;
  std::int64_t last_ = 0;  ///< that went through
  bool has_begun_ = false;
};

/// How long to wait for an input, s. Each time that it does not come within its timeout, nothing waits for it for 1, 2,
/// 4 … 30 s; when it comes, the pauses begin at 1 s again. `now`: s of a monotonic clock.
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

/// Lets a report of one kind through at most once in a period. ROS' own throttle shares its state between all nodelets
/// of a manager, lets different errors hide each other and goes by simulated time, which may stand still; the system's
/// clock may be set back.
class ReportThrottle {
 public:
  /// Whether to report `text` now. Texts that differ in their numbers alone are of one kind.
  bool allows(const std::string& text) {
    const ros::SteadyTime now = ros::SteadyTime::now();
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto [last, is_new] = last_.try_emplace(kindOf(text), now);
    if (!is_new && now - last->second < ros::WallDuration(kPeriod)) return false;
    last->second = now;
    if (last_.size() > kKinds) last_.clear();
    return true;
  }

 private:
  /// The words without those that hold a digit, but for names of topics.
  static std::string kindOf(const std::string& text) {
    const auto isDigit = [](unsigned char c) { return std::isdigit(c) != 0; };
    std::istringstream words(text);
    std::string kind, word;
    while (words >> word)
      if (word.front() == '/' || std::none_of(word.begin(), word.end(), isDigit)) kind += word + " ";
    return kind;
  }

  static constexpr double kPeriod = 5.0;      // s
  static constexpr std::size_t kKinds = 100;  // remembered

  std::mutex mutex_;
  std::map<std::string, ros::SteadyTime> last_;
};

}  // namespace sdvo
