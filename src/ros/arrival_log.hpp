#pragma once

#include <ros/time.h>

#include <array>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

#include "../config/interface_options.hpp"

namespace sdvo {

/// What arrived on the four inputs of stereo processing, to tell why no pair comes together.
class ArrivalLog {
 public:
  enum Input { kLeftImage, kRightImage, kLeftInfo, kRightInfo };
  static constexpr int kInputs = 4;

  /// `topics` in the order of Input.
  ArrivalLog(std::array<std::string, kInputs> topics, const StereoInputOptions& options);

  /// `now`: s, of any clock that does not jump.
  void note(Input input, const ros::Time& stamp, double now);
  void notePair();

  /// When no pair came together since the last call: what arrived on each topic, how its stamps go together and what
  /// to do. Empty when pairs come.
  std::string explainSilence();

 private:
  struct Arrival {
    std::int64_t stamp;  ///< ns
    double now;          ///< s
  };
  struct Topic {
    std::string name;
    std::deque<Arrival> arrivals;
    int count = 0, zero_stamps = 0;
  };
  /// How the stamps of a topic go together with those of the left images.
  struct Comparison {
    double smallest_gap;   ///< s, infinite where one of both is missing
    double largest_delay;  ///< s, between the arrivals of messages of equal stamps
  };

  /// Of stamps in a pair, s.
  double largestGap() const { return options_.approximate_sync ? options_.max_interval : options_.sync_tolerance; }
  Comparison compareWithLeftImage(const Topic& topic) const;
  std::string advise() const;

  const StereoInputOptions options_;
  std::mutex mutex_;
  std::array<Topic, kInputs> topics_;
  int pairs_ = 0;
};

}  // namespace sdvo
