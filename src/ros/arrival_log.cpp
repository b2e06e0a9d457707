#include "arrival_log.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "stamps.hpp"

namespace sdvo {
namespace {

constexpr std::size_t kRemembered = 300;  // arrivals on each topic

}  // namespace

ArrivalLog::ArrivalLog(std::array<std::string, kInputs> topics, const StereoInputOptions& options) : options_(options) {
  for (int input = 0; input < kInputs; ++input) topics_[input].name = topics[input];
}

void ArrivalLog::note(Input input, const ros::Time& stamp, double now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Topic& topic = topics_[input];
  ++topic.count;
  if (stamp.isZero()) {
    ++topic.zero_stamps;
    return;
  }
  topic.arrivals.push_back({nanoseconds(stamp), now});
  if (topic.arrivals.size() > kRemembered) topic.arrivals.pop_front();
}

void ArrivalLog::notePair() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++pairs_;
}

std::string ArrivalLog::explainSilence() {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::ostringstream text;
  if (pairs_ == 0) {
    text << "no synchronised stereo pair; received:";
    for (const Topic& topic : topics_) {
      text << " " << topic.name << " " << topic.count;
      if (topic.zero_stamps > 0) text << " (" << topic.zero_stamps << " with zero stamps)";
    }
    text << advise();
  }
  for (Topic& topic : topics_) {
    topic.arrivals.clear();
    topic.count = topic.zero_stamps = 0;
  }
  pairs_ = 0;
  return text.str();
}

ArrivalLog::Comparison ArrivalLog::compareWithLeftImage(const Topic& topic) const {
  Comparison comparison{std::numeric_limits<double>::infinity(), 0.0};
  for (const Arrival& left : topics_[kLeftImage].arrivals)
    for (const Arrival& other : topic.arrivals) {
      const double gap = 1e-9 * std::abs(static_cast<double>(left.stamp - other.stamp));
      comparison.smallest_gap = std::min(comparison.smallest_gap, gap);
      if (gap <= largestGap())
        comparison.largest_delay = std::max(comparison.largest_delay, std::abs(left.now - other.now));
    }
  return comparison;
}

std::string ArrivalLog::advise() const {
  const std::deque<Arrival>& left = topics_[kLeftImage].arrivals;
  std::ostringstream text;
  const Topic* latest = nullptr;
  double delay = 0.0;
  for (const Topic& topic : topics_) {
    if (&topic == &topics_[kLeftImage]) continue;
    if (!left.empty() && topic.count == 0 && &topic != &topics_[kRightImage])
      text << "; " << topic.name << " must have a message for each image, with the image's stamp";
    const Comparison comparison = compareWithLeftImage(topic);
    if (!std::isfinite(comparison.smallest_gap)) return text.str();  // the counts say it
    if (comparison.smallest_gap > largestGap()) {
      if (&topic == &topics_[kRightImage])
        text << "; smallest gap between a left and a right image stamp " << comparison.smallest_gap
             << " s, larger than " << (options_.approximate_sync ? "max_interval (" : "sync_tolerance (")
             << largestGap() << " s)"
             << (options_.approximate_sync ? "" : ": set approximate_sync if the cameras are not triggered together");
      else
        text << "; the stamps of " << topic.name << " are not those of the left images, at best "
             << comparison.smallest_gap << " s off";
      return text.str();
    }
    if (comparison.largest_delay > delay) {
      delay = comparison.largest_delay;
      latest = &topic;
    }
  }
  // Equal stamps on all topics, and yet no pair: one side waits in its queue for longer than that holds.
  if (latest && left.size() > 1 && left.back().now > left.front().now) {
    const double rate = static_cast<double>(left.size() - 1) / (left.back().now - left.front().now);
    text << "; stamps agree, but messages of " << latest->name << " and of the left images arrive " << delay
         << " s apart: set sync_queue_size, now " << options_.sync_queue_size << ", to at least "
         << static_cast<int>(std::ceil(delay * rate)) + 2;
  }
  return text.str();
}

}  // namespace sdvo
