#pragma once

#include <ros/time.h>

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <mutex>
#include <string>
#include <utility>

#include "../config/interface_options.hpp"
#include "diagnostic_tasks.hpp"

namespace sdvo {

/// Arrivals on the four inputs of stereo processing: counts images that make no pair, and gives the cause. Times in s
/// of any steady clock. For any thread.
class ArrivalLog {
 public:
  enum Input { kLeftImage, kRightImage, kLeftInfo, kRightInfo };
  static constexpr int kInputs = 4;
  using Topics = std::array<std::string, kInputs>;

  ArrivalLog(const StereoInputOptions& options, UnusedInput& unused) : options_(options), unused_(unused) {}

  /// A new subscription; `topics` in the order of Input.
  void begin(const Topics& topics, double now);
  void note(Input input, const ros::Time& stamp, double now);
  void notePair(const ros::Time& left, const ros::Time& right, double now);

  /// If more than `max_unused` of the last pairs are incomplete: how many, which messages are missing, how far stamps
  /// are apart, and a remedy. Empty otherwise.
  std::string explainLoss(double now);
  /// If no pair was complete for ten seconds: what arrived on each topic, and a remedy. The end of the input is
  /// reported once. Empty otherwise.
  std::string explainSilence(double now);

  /// Hz, of each topic in the last seconds, with its name.
  std::array<std::pair<std::string, double>, kInputs> rates(double now) const;

 private:
  /// A message waits for its partners until its pair is complete, or until it is too old for one.
  enum class Fate { kWaits, kPaired, kLost };
  struct Arrival {
    std::int64_t stamp;  ///< ns; 0: none
    double now;          ///< s
    Fate fate = Fate::kWaits;
    bool is_counted = false;  ///< as UnusedInput::kUnpaired
  };
  struct Topic {
    std::string name;
    std::deque<Arrival> arrivals;  ///< of the last seconds
  };
  /// Of pairs since some time.
  struct Use {
    int used = 0, lost = 0, lefts = 0, rights = 0;  ///< the last two: images without partners
  };

  /// Differences of stamps between unused images and the nearest messages of another topic, s.
  struct Gaps {
    int all = 0, apart = 0, missing = 0;  ///< images; difference beyond what is allowed; beyond half a period
    double least = std::numeric_limits<double>::infinity(), most = 0.0;  ///< of those apart
    double delay = 0.0;                                                  ///< largest between arrivals of one stamp
  };

  /// Of stamps in a pair, s.
  double largestGap() const { return options_.approximate_sync ? options_.max_interval : options_.sync_tolerance; }
  double period() const;
  bool isEarly(const Arrival& arrival) const;
  bool isAPairOfItsOwn(Input input, const Arrival& arrival) const;
  void giveUp(Input input, Arrival& arrival);
  void giveUpWhatIsOld(double now);
  Use usedSince(double begin) const;
  std::string received(double begin) const;
  Gaps gapsBetween(Input from, Input to, double begin) const;
  std::string advise(double begin) const;

  const StereoInputOptions options_;
  UnusedInput& unused_;
  mutable std::mutex mutex_;
  std::array<Topic, kInputs> topics_;
  double begin_ = 0.0;            ///< of the subscription
  std::int64_t first_stamp_ = 0;  ///< from which on all topics have messages, ns; 0: some have none
  double complete_ = 0.0;         ///< arrival of the first message of the last topic
  double longest_wait_ = 0.0;     ///< of a message for its pair
  bool has_pairs_ = false, has_ended_ = false;
};

}  // namespace sdvo
