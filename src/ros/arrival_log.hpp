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

/// What arrives on the four inputs of stereo processing and what becomes of it: counts pairs that do not come together
/// and tells why. Times are s of any clock that does not jump. For any thread.
class ArrivalLog {
 public:
  enum Input { kLeftImage, kRightImage, kLeftInfo, kRightInfo };
  static constexpr int kInputs = 4;
  using Topics = std::array<std::string, kInputs>;

  ArrivalLog(const StereoInputOptions& options, UnusedInput& unused) : options_(options), unused_(unused) {}

  /// Subscribed anew, to `topics` in the order of Input.
  void begin(const Topics& topics, double now);
  void note(Input input, const ros::Time& stamp, double now);
  void notePair(const ros::Time& left, const ros::Time& right, double now);

  /// When more than `max_unused` of the last pairs did not come together: how many, which messages lack their partners,
  /// how far stamps are apart, and what to do. Empty otherwise.
  std::string explainLoss(double now);
  /// When no pair came together for ten seconds: what arrived on each topic and what to do. Input that ended after
  /// pairs is said once. Empty otherwise.
  std::string explainSilence(double now);

  /// Hz, of each topic in the last seconds, with its name.
  std::array<std::pair<std::string, double>, kInputs> rates(double now) const;

 private:
  enum class Fate { kWaits, kPaired, kLost };
  struct Arrival {
    std::int64_t stamp;  ///< ns; 0: none
    double now;          ///< s
    Fate fate = Fate::kWaits;
    bool is_counted = false;  ///< as a pair that is not used
  };
  struct Topic {
    std::string name;
    std::deque<Arrival> arrivals;  ///< of the last seconds
  };
  /// Of pairs since some time.
  struct Use {
    int used = 0, lost = 0, lefts = 0, rights = 0;  ///< the last two: images without partners
  };

  /// From images that are not used to the nearest messages of another topic, s.
  struct Gaps {
    int all = 0, apart = 0, missing = 0;  ///< the nearest one is farther than allowed; than half a period
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
  std::int64_t first_stamp_ = 0;  ///< from which on all topics are there, ns; 0: they are not
  double complete_ = 0.0;         ///< when they were
  double longest_wait_ = 0.0;     ///< of a message that was used after all
  bool has_pairs_ = false, has_ended_ = false;
};

}  // namespace sdvo
