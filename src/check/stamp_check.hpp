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

  /// `stamp` in ns, zero when the message has none; `arrival` in s of the clock that stamps should be of.
  void note(std::size_t input, std::int64_t stamp, double arrival);
  /// Four messages of one stamp came together.
  void notePair(std::int64_t stamp);

  /// Whether all four come, and often enough: `min_rate`, `max_rate` in Hz. `explanation` says why no pair came.
  Finding topics(double min_rate, double max_rate, const std::string& explanation) const;
  /// Whether stamps are those of a camera: of the system's clock, rising, without gaps, each with its partner.
  Finding stamps() const;

  double rate() const;  ///< of the pairs by their stamps, Hz; zero when it is not known

 private:
  std::array<std::string, kInputs> topics_;
  std::array<int, kInputs> counts_{};
  std::vector<double> delays_;  ///< of left images, s
  std::vector<std::int64_t> pairs_;
};

/// Of poses that come so late, s; negative: before their time. `most`: of a machine that is fast enough.
Finding checkLatency(double latency, double most);

}  // namespace sdvo
