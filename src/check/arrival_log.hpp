#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "../config/interface_options.hpp"
#include "finding.hpp"
#include "input_monitor.hpp"
#include "unused_input.hpp"

namespace sdvo {

/// How the messages of a camera arrived: steps of its check, and what they need.
struct ArrivalFindings {
  Finding topics, stamps, transform;
  double rate = 0.0;                               ///< of the pairs, Hz
  std::optional<Eigen::Isometry3d> T_base_camera;  ///< as TF has it
};

/// Arrivals on the four inputs of a stereo camera, and the pairs made of them: rates, lateness, order, gaps, and images
/// that make no pair, with the cause. /diagnostics, the log, check_camera and pages print its findings. Stamps in ns,
/// 0: none. Times are in s of any steady clock; checkStamps() needs the clock of the stamps. For any thread.
class ArrivalLog {
 public:
  enum Input { kLeftImage, kRightImage, kLeftInfo, kRightInfo };
  static constexpr int kInputs = 4;
  using Topics = std::array<std::string, kInputs>;

  static constexpr double kMemory = 10.0;  // s

  /// Arrivals are forgotten after `memory` (s), those of a recording that is checked as a whole never.
  ArrivalLog(const StereoInputOptions& options, UnusedInput& unused, double memory = kMemory)
      : options_(options), unused_(unused), memory_(memory), pairs_("pairs", "", options.max_silence, options.rates) {}

  /// A new subscription; `topics` in the order of Input.
  void begin(const Topics& topics, double now);
  void note(Input input, std::int64_t stamp, double now);
  void notePair(std::int64_t left, std::int64_t right, double now);

  /// Rate and silence of the pairs.
  InputMonitor& pairs() { return pairs_; }

  /// If more than `max_unused` of the last pairs are incomplete: how many, which messages are missing, how far stamps
  /// are apart, and a remedy. Empty otherwise.
  std::string explainLoss(double now);
  /// If no pair was complete for ten seconds: what arrived on each topic, and a remedy. The end of the input is
  /// reported once. Empty otherwise.
  std::string explainSilence(double now);

  /// Of the last seconds: whether messages make pairs whose stamps differ by `max_gap` (s) at most.
  Finding checkPairs(double now, double max_gap, Values& values);

  // Of all arrivals in memory.

  /// Whether all topics have messages, and pairs come at the rate that is expected.
  Finding checkTopics();
  /// Whether stamps are of the clock of arrivals, increase, have no gaps, and have partners.
  Finding checkStamps() const;
  double pairRate() const;  ///< by the stamps, Hz; zero when it is not known
  ArrivalFindings findings(const Finding& transform) {
    return {checkTopics(), checkStamps(), transform, pairRate(), {}};
  }

 private:
  /// A message waits for its partners until its pair is complete, or until it is too old for one. kCounted: lost, and
  /// counted as UnusedInput::kUnpaired.
  enum class Fate { kWaits, kPaired, kLost, kCounted };
  struct Arrival {
    std::int64_t stamp;
    double now;
    Fate fate = Fate::kWaits;

    bool isLost() const { return fate == Fate::kLost || fate == Fate::kCounted; }
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
    double delay = 0.0;  ///< largest between arrivals of stamps not apart
  };

  double period() const;
  std::vector<double> pairPeriods() const;
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
  const double memory_;
  InputMonitor pairs_;
  mutable std::mutex mutex_;
  std::array<Topic, kInputs> topics_;
  double begin_ = 0.0;            ///< of the subscription
  std::int64_t first_stamp_ = 0;  ///< from which on all topics have messages, ns; 0: some have none
  double complete_ = 0.0;         ///< arrival of the first message of the last topic
  double longest_wait_ = 0.0;     ///< of a message for its pair
  double largest_gap_ = 0.0;      ///< s, between the stamps of a pair since the last checkPairs()
  bool has_pairs_ = false, has_ended_ = false;
};

}  // namespace sdvo
