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

/// Limits a rate by stamps. An item passes if 95 % of a period has elapsed since the last one that passed. With 100 %,
/// jitter of an input at twice the rate would let every third item pass instead of every second one.
class Pace {
 public:
  /// `max_rate`: Hz; 0: no limit.
  explicit Pace(double max_rate) : period_(max_rate > 0.0 ? static_cast<std::int64_t>(1e9 / max_rate) : 0) {}

  /// Whether the item of this stamp (ns) passes. Stamps that do not increase pass.
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

/// Time to wait for an input, s. After each timeout there is no waiting for 1, 2, 4 … 30 s. Once the input comes,
/// pauses begin at 1 s again. `now`: s of a steady clock.
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

/// Passes one report of each kind in a period of steady time. ROS' own throttle is shared by all nodelets of a manager,
/// lets different errors hide each other, and stops with simulated time or when the system's clock is set back.
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
