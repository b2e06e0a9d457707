#include "arrival_log.hpp"

#include <algorithm>
#include <cmath>

#include "../common/statistics.hpp"
#include "../common/text.hpp"

namespace sdvo {
namespace {

constexpr double kFastest = 200.0;   // arrivals a second on each topic (chosen): more are no camera's
constexpr double kLately = 5.0;      // s (chosen), of losses and rates
constexpr double kGrace = 1.0;       // s (chosen) that an image waits for its partner beyond the longest wait so far
constexpr double kLate = 0.1;        // s between messages of one stamp (chosen): a queue is too short, perhaps
constexpr double kHalf = 0.45;       // ratio of a period: images of one pair are nearer; below 0.5, for jitter
constexpr double kOtherClock = 1.0;  // s between stamps and arrivals (chosen): no camera takes as long
constexpr double kFewLost = 0.02;    // ratio of pairs (chosen): drivers lose one now and then

constexpr const char* kNoPairs = "no pairs";
constexpr const char* kTrigger = "trigger both cameras together, and stamp each image with its own time";
constexpr const char* kLosses = "look for losses on the way (USB, network, processor)";

double secondsBetween(std::int64_t a, std::int64_t b) {
  return 1e-9 * static_cast<double>(b - a);
}

}  // namespace

void ArrivalLog::begin(const Topics& topics, double now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (int input = 0; input < kInputs; ++input) topics_[input] = {topics[input], {}};
  begin_ = now;
  first_stamp_ = 0;
  longest_wait_ = 0.0;
  has_pairs_ = has_ended_ = false;
  pairs_.noteTopics(topics[kLeftImage] + " and " + topics[kRightImage]);
  pairs_.noteIdle("");
}

void ArrivalLog::note(Input input, std::int64_t stamp, double now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::deque<Arrival>& arrivals = topics_[input].arrivals;
  arrivals.push_back({stamp, now});
  has_ended_ = false;
  if (stamp == 0) arrivals.back().fate = Fate::kLost;
  if (first_stamp_ == 0) {
    complete_ = now;
    const auto is_silent = [](const Topic& topic) { return topic.arrivals.empty(); };
    if (std::none_of(topics_.begin(), topics_.end(), is_silent))
      for (const Topic& topic : topics_) first_stamp_ = std::max(first_stamp_, topic.arrivals.front().stamp);
  }
  while (static_cast<double>(arrivals.size()) > kFastest * memory_ || arrivals.front().now < now - memory_) {
    if (arrivals.front().fate == Fate::kWaits) giveUp(input, arrivals.front());
    arrivals.pop_front();
  }
}

void ArrivalLog::notePair(std::int64_t left, std::int64_t right, double now) {
  pairs_.note(left);
  const std::lock_guard<std::mutex> lock(mutex_);
  has_pairs_ = true;
  largest_gap_ = std::max(largest_gap_, std::abs(secondsBetween(left, right)));
  for (const auto& [input, stamp] : {std::pair(kLeftImage, left), std::pair(kRightImage, right)}) {
    std::deque<Arrival>& arrivals = topics_[input].arrivals;
    const auto used = std::find_if(arrivals.rbegin(), arrivals.rend(), [stamp = stamp](const Arrival& arrival) {
      return arrival.stamp == stamp && arrival.fate != Fate::kPaired;
    });
    if (used == arrivals.rend()) continue;
    if (std::exchange(used->fate, Fate::kPaired) == Fate::kCounted) unused_.takeBack(UnusedInput::kUnpaired);
    longest_wait_ = std::max(longest_wait_, now - used->now);
  }
}

/// Of the left images, s.
double ArrivalLog::period() const {
  constexpr double kUsual = 0.1;
  constexpr std::size_t kEnough = 20;
  const std::deque<Arrival>& arrivals = topics_[kLeftImage].arrivals;
  std::vector<double> steps;
  for (std::size_t k = arrivals.size(); k > 1 && steps.size() < kEnough; --k)
    steps.push_back(std::abs(secondsBetween(arrivals[k - 2].stamp, arrivals[k - 1].stamp)));
  return steps.empty() ? kUsual : median(steps);
}

/// Whether the image came before all four topics were connected. Then its partner may be missing without a fault.
bool ArrivalLog::isEarly(const Arrival& arrival) const {
  constexpr double kConnecting = 2.0;  // s (chosen)
  return first_stamp_ == 0 || (arrival.stamp < first_stamp_ && arrival.now < complete_ + kConnecting &&
                               secondsBetween(arrival.stamp, first_stamp_) > kHalf * period());
}

/// Whether the lost image counts as a lost pair. If both images of a pair are lost, only the left one counts.
bool ArrivalLog::isAPairOfItsOwn(Input input, const Arrival& arrival) const {
  if (input == kLeftImage) return true;
  const double half = kHalf * period();
  const std::deque<Arrival>& lefts = topics_[kLeftImage].arrivals;
  return std::none_of(lefts.begin(), lefts.end(), [&](const Arrival& left) {
    return left.fate != Fate::kPaired && !isEarly(left) && std::abs(secondsBetween(left.stamp, arrival.stamp)) < half;
  });
}

void ArrivalLog::giveUp(Input input, Arrival& arrival) {
  const bool is_image = input == kLeftImage || input == kRightImage;
  const bool counts = is_image && !isEarly(arrival) && isAPairOfItsOwn(input, arrival);
  arrival.fate = counts ? Fate::kCounted : Fate::kLost;
  if (counts) unused_.add(UnusedInput::kUnpaired);
}

void ArrivalLog::giveUpWhatIsOld(double now) {
  for (const Input input : {kLeftImage, kRightImage})
    for (Arrival& arrival : topics_[input].arrivals)
      if (arrival.fate == Fate::kWaits && arrival.now < now - kGrace - longest_wait_) giveUp(input, arrival);
}

ArrivalLog::Use ArrivalLog::usedSince(double begin) const {
  Use use;
  for (const Input input : {kLeftImage, kRightImage})
    for (const Arrival& arrival : topics_[input].arrivals) {
      if (arrival.now < begin) continue;
      use.used += input == kLeftImage && arrival.fate == Fate::kPaired;
      use.lost += arrival.fate == Fate::kCounted;
      (input == kLeftImage ? use.lefts : use.rights) += arrival.isLost() && !isEarly(arrival);
    }
  return use;
}

std::string ArrivalLog::explainLoss(double now) {
  constexpr int kFewest = 3;  // pairs (chosen): fewer are an accident
  const std::lock_guard<std::mutex> lock(mutex_);
  giveUpWhatIsOld(now);
  const double begin = now - kLately;
  const Use use = usedSince(begin);
  if (use.lost < kFewest || use.lost <= options_.rates.max_unused * (use.used + use.lost)) return "";
  return text(0, use.lost, " of ", use.used + use.lost, " stereo pairs in ", kLately, " s are not used: ", use.lefts,
              " left and ", use.rights, " right images without partners; received:", received(begin), advise(begin));
}

std::string ArrivalLog::explainSilence(double now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (now < begin_ + kMemory || usedSince(now - kMemory).used > 0) return "";
  const auto is_silent = [&](const Topic& topic) {
    return topic.arrivals.empty() || topic.arrivals.back().now < now - kMemory;
  };
  if (has_pairs_ && std::all_of(topics_.begin(), topics_.end(), is_silent))
    return std::exchange(has_ended_, true) ? "" : text(0, "no message of the camera for ", kMemory, " s: it has ended");
  return "no synchronised stereo pair; received:" + received(now - kMemory) + advise(now - kMemory);
}

std::string ArrivalLog::received(double begin) const {
  std::string all;
  for (const Topic& topic : topics_) {
    int count = 0, zero = 0;
    for (const Arrival& arrival : topic.arrivals) {
      count += arrival.now >= begin;
      zero += arrival.now >= begin && arrival.stamp == 0;
    }
    all += text(0, " ", topic.name, " ", count);
    if (zero > 0) all += text(0, " (", zero, " with zero stamps)");
  }
  return all;
}

Finding ArrivalLog::checkPairs(double now, double max_gap, Values& values) {
  const std::string loss = explainLoss(now);
  const auto silence = pairs_.silence();
  const std::lock_guard<std::mutex> lock(mutex_);
  const double gap = std::exchange(largest_gap_, 0.0);
  values.add("largest gap [ms]", text(2, 1e3 * gap));
  for (const Topic& topic : topics_) {
    const auto lately = std::count_if(topic.arrivals.begin(), topic.arrivals.end(),
                                      [&](const Arrival& arrival) { return arrival.now >= now - kLately; });
    values.add("rate of " + topic.name + " [Hz]",
               text(2, static_cast<double>(lately) / std::clamp(now - begin_, 1.0, kLately)));
  }
  if (!loss.empty() && (!silence || silence->isFault())) return {Verdict::kWarn, loss};
  return warnIf(!silence && gap > max_gap,
                silence ? kNoPairs : text(1, "left and right are up to ", 1e3 * gap, " ms apart"), kTrigger);
}

/// Between successive pairs, s.
std::vector<double> ArrivalLog::pairPeriods() const {
  std::vector<double> periods;
  const Arrival* before = nullptr;
  for (const Arrival& left : topics_[kLeftImage].arrivals) {
    if (left.fate != Fate::kPaired) continue;
    if (before) periods.push_back(secondsBetween(before->stamp, left.stamp));
    before = &left;
  }
  return periods;
}

double ArrivalLog::pairRate() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double period = quantile(pairPeriods(), 0.5);
  return period > 0.0 ? 1.0 / period : 0.0;
}

Finding ArrivalLog::checkTopics() {
  const double rate = pairRate();
  double newest = 0.0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const Topic& topic : topics_) {
      if (topic.arrivals.empty())
        return {Verdict::kFail, "nothing came on " + topic.name,
                "start the driver with both sides, or give the names that it has (--camera, --left, --right, --image)"};
      newest = std::max(newest, topic.arrivals.back().now);
    }
    if (has_pairs_) {
      const std::size_t periods = pairPeriods().size();
      if (periods == 0) return {Verdict::kOpen, "one pair alone", "take more of them"};
      return checkRate(text(1, periods + 1, " pairs, ", rate, " Hz"), rate, options_.rates);
    }
  }
  return {Verdict::kFail, explainSilence(newest), "see docs/troubleshooting.md, 'Pairs that do not come together'"};
}

Finding ArrivalLog::checkStamps() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::vector<double> periods = pairPeriods();
  if (periods.empty()) return {Verdict::kOpen, kNoPairs};
  const std::deque<Arrival>&lefts = topics_[kLeftImage].arrivals, &rights = topics_[kRightImage].arrivals;
  const double all = static_cast<double>(std::max(lefts.size(), rights.size()));
  const double alone = 1.0 - static_cast<double>(periods.size() + 1) / all;
  const double usual = quantile(periods, 0.5), longest = *std::max_element(periods.begin(), periods.end());
  std::vector<double> delays;
  for (const Arrival& left : lefts) delays.push_back(left.now - 1e-9 * static_cast<double>(left.stamp));
  const double delay = quantile(delays, 0.5);
  const std::string what = text(1, "longest gap ", 1e3 * longest, " ms, ", 100.0 * alone, " % without partner");

  if (*std::min_element(periods.begin(), periods.end()) <= 0.0)
    return {Verdict::kWarn, "stamps fall; " + what, "one recording at a time, and a driver that does not restart"};
  if (Finding clock = checkLatency(delay, kOtherClock, "arrival", kOtherClock); clock.isFault()) return clock;
  if (alone > kFewLost) {
    const std::string cause = advise(-std::numeric_limits<double>::infinity());  // begins with "; "
    return {Verdict::kWarn, what, cause.empty() ? std::string(kTrigger) + ", or " + kLosses : cause.substr(2)};
  }
  const auto gaps = std::count_if(periods.begin(), periods.end(), [&](double period) { return period > 1.5 * usual; });
  return warnIf(static_cast<double>(gaps) > kFewLost * static_cast<double>(periods.size()), what,
                std::string("pairs are missing: ") + kLosses);
}

ArrivalLog::Gaps ArrivalLog::gapsBetween(Input from, Input to, double begin) const {
  const double half = kHalf * period();
  Gaps gaps;
  for (const Arrival& here : topics_[from].arrivals) {
    if (here.now < begin || here.fate == Fate::kPaired || here.stamp == 0) continue;
    double gap = std::numeric_limits<double>::infinity();
    for (const Arrival& there : topics_[to].arrivals) {
      if (there.stamp == 0) continue;
      const double here_to_there = std::abs(secondsBetween(here.stamp, there.stamp));
      gap = std::min(gap, here_to_there);
      if (here_to_there <= options_.pairing.allowedGap())
        gaps.delay = std::max(gaps.delay, std::abs(there.now - here.now));
    }
    ++gaps.all;
    gaps.missing += gap >= half;
    if (gap <= options_.pairing.allowedGap() || gap >= half) continue;
    ++gaps.apart;
    gaps.least = std::min(gaps.least, gap);
    gaps.most = std::max(gaps.most, gap);
  }
  return gaps;
}

/// The likely cause and a remedy, by the stamps of images without a pair. The first cause that most of them show.
std::string ArrivalLog::advise(double begin) const {
  const Gaps right = gapsBetween(kLeftImage, kRightImage, begin), left = gapsBetween(kRightImage, kLeftImage, begin);
  if (topics_[kLeftImage].arrivals.empty() || topics_[kRightImage].arrivals.empty()) return "";  // the counts show it
  // Stamps of left and right differ by more than pairing allows.
  if (2 * right.apart > right.all)
    return text(1, "; the nearest stamps of left and right are ", 1e3 * right.least, " to ", 1e3 * right.most,
                " ms apart, more than ", options_.pairing.approximate_sync ? "max_interval (" : "sync_tolerance (",
                1e3 * options_.pairing.allowedGap(), " ms)") +
           (options_.pairing.approximate_sync ? ""
                                              : text(3, ": set sync_tolerance to ", right.most + 0.001,
                                                     " if one trigger takes both, else approximate_sync to true"));
  // Images of one side are missing.
  for (const auto& [gaps, sides] :
       {std::pair(right, " left images have no right one"), std::pair(left, " right images have no left one")})
    if (2 * gaps.missing > gaps.all)
      return "; " + std::to_string(gaps.missing) + sides +
             " within half a period: does the driver or the network lose images, or stamp them wrong?";
  // A camera_info is missing, or has other stamps than its images.
  const Gaps* latest = &right;
  std::array<Gaps, 2> infos;
  for (const Input input : {kLeftInfo, kRightInfo}) {
    Gaps& info = infos[input - kLeftInfo] = gapsBetween(kLeftImage, input, begin);
    if (2 * (info.apart + info.missing) > info.all)
      return "; " + topics_[input].name + " must have a message for each image, with the image's stamp";
    if (info.delay > latest->delay) latest = &info;
  }
  // Equal stamps on all topics, and no pair: one side came so late that the queue had dropped the other.
  if (latest->delay <= kLate) return "";
  // Periods that one side waits (0.01 for rounding), the pair itself, and one to spare.
  return text(2, "; stamps agree, but messages arrive ", latest->delay, " s apart: set sync_queue_size, now ",
              options_.sync_queue_size, ", to at least ",
              static_cast<int>(std::ceil(latest->delay / period() - 0.01)) + 2);
}

}  // namespace sdvo
