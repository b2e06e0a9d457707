#pragma once

#include <ros/time.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <mutex>
#include <sstream>
#include <string>

namespace sdvo {

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
