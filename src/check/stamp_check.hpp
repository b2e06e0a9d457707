#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "finding.hpp"

namespace sdvo {

/// Rates and stamps of the four topics of a stereo camera: left and right image, left and right camera_info.
class StampCheck {
 public:
  static constexpr std::size_t kInputs = 4;

  explicit StampCheck(std::array<std::string, kInputs> topics) : topics_(std::move(topics)) {}

  /// `stamp` in ns, zero if the message has none; `arrival` in s of the system's clock.
  void note(std::size_t input, std::int64_t stamp, double arrival);
  /// Four messages of one stamp came together.
  void notePair(std::int64_t stamp);

  /// Whether all four come, at a rate in [`min_rate`, `max_rate`] (Hz). `explanation`: reason if there was no pair.
  Finding topics(double min_rate, double max_rate, const std::string& explanation) const;
  /// Whether stamps are of the system's clock, increase, have no gaps, and have partners.
  Finding stamps() const;

  double rate() const;  ///< of the pairs by their stamps, Hz; zero when it is not known

 private:
  std::array<std::string, kInputs> topics_;
  std::array<int, kInputs> counts_{};
  std::vector<double> delays_;  ///< of left images, s
  std::vector<std::int64_t> pairs_;
};

/// `latency` of poses, s; negative for stamps in the future. `most`: the largest one that is no fault.
Finding checkLatency(double latency, double most);

}  // namespace sdvo
