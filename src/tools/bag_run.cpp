#include "bag_run.hpp"

#include <array>
#include <cstdint>
#include <stdexcept>

#include "../ros/stamps.hpp"

namespace sdvo {

BagRun::BagRun(const std::string& bag, const std::string& camera, const PipelineOptions& options, bool with_halves)
    : options_(options), pairs_(bag, camera), whole_(options) {
  if (with_halves) halves_.emplace(Halves{{}, OfflineRun(options), OfflineRun(options)});
  StampFilter<Recorded> filter;
  std::string refusal;
  const BagPairs::LeftOver left_over = pairs_.forEach([&](const StereoPairMessages& pair,
                                                          const BagPairs::Times& recorded, const ros::Time& arrival) {
    const std::int64_t stamp = nanoseconds(pair.left_image->header.stamp);
    for (const auto& passed : filter.add({pair, recorded}, stamp, nanoseconds(arrival))) {
      if (passed.source_restarts > 0)
        throw std::runtime_error("stamps jump back for good: these are several recordings, one bag for each is needed");
      try {
        process(passed.item);
      } catch (const std::invalid_argument& e) {
        ++left_out_;
        refusal = e.what();
      }
    }
  });
  if (used_.empty())
    throw std::runtime_error("no pair can be used: " + (refusal.empty() ? left_over.problem : refusal));
  left_out_ += left_over.stamps + static_cast<int>(filter.dropped());
}

void BagRun::process(const Recorded& pair) {
  const ros::Time stamp = pair.messages.left_image->header.stamp;
  const DecodedPair decoded = decoder_.decode(pair.messages);
  const StereoFeatures features = whole_.process(decoded.camera, decoded.left, decoded.right, nanoseconds(stamp));
  decoder_.accept(decoded.camera);
  used_.push_back({stamp, pair.times});
  if (!halves_) return;
  const std::array<std::vector<int>, 2> rows = halves_->features.split(features, whole_.last().flow);
  halves_->first.processFeatures(features.select(rows[0]));
  halves_->second.processFeatures(features.select(rows[1]));
}

SelfCheck BagRun::shuttle() const {
  OfflineRun back(options_);
  PairDecoder decoder;
  const std::int64_t first = nanoseconds(used_.front().stamp), last = nanoseconds(used_.back().stamp);
  for (auto pair = used_.rbegin(); pair != used_.rend(); ++pair) {
    const StereoPairMessages messages = pairs_.read(pair->stamp, pair->times);
    const DecodedPair decoded = decoder.decode(messages);  // whose images are the messages'
    // Mirrored stamps increase, and the time between pairs is the same.
    back.process(decoded.camera, decoded.left, decoded.right, first + (last - nanoseconds(pair->stamp)));
    decoder.accept(decoded.camera);
  }
  return checkShuttle(whole_, back);
}

}  // namespace sdvo
