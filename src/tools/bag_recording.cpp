#include "bag_recording.hpp"

#include <rosbag/view.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>

#include "../common/stamp_filter.hpp"
#include "../messages/stamps.hpp"
#include "../ros/pair_decoder.hpp"
#include "camera_input.hpp"

namespace sdvo {
namespace {

/// Stamps that wait for partners, of which none may ever be complete: images take memory.
constexpr std::size_t kWaiting = 100;

void put(const StereoMessage& message, StereoPairMessages& pair) {
  if (message.image)
    (message.input == 0 ? pair.left_image : pair.right_image) = message.image;
  else
    (message.input == 2 ? pair.left_info : pair.right_info) = message.info;
}

/// Whether both are stamps of one trigger, as the nodelet has it by default.
bool areOne(const ros::Time& a, const ros::Time& b) {
  return std::abs(secondsBetween(a, b)) <= StereoInputOptions().sync_tolerance;
}

bool isComplete(const StereoPairMessages& pair) {
  return pair.left_image && pair.right_image && pair.left_info && pair.right_info;
}

}  // namespace

BagRecording::BagRecording(const std::string& path, const StereoNames& names) : path_(path) {
  openBag(path, bag_);
  topics_ = ofBag(path, [&] { return topicsIn(bag_, names); });
  rosbag::View view(bag_);
  std::set<std::string> recorded, cameras;
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    recorded.insert(connection->topic);
    if (connection->datatype == "sensor_msgs/Image" || connection->datatype == "sensor_msgs/CompressedImage")
      cameras.insert(connection->topic);
  }
  const auto missing = std::find_if(topics_.begin(), topics_.end(), [&](const auto& t) { return !recorded.count(t); });
  if (missing == topics_.end()) return;
  std::string images;
  for (const std::string& topic : cameras) images += (images.empty() ? "" : ", ") + topic;
  throw std::runtime_error("'" + path + "' has no " + *missing + "; its images: " + (images.empty() ? "none" : images) +
                           ": name the topics by --camera, --left, --right, --image");
}

int BagRecording::size() const {
  return static_cast<int>(rosbag::View(bag_, rosbag::TopicQuery(topics_[0])).size());
}

int BagRecording::forEach(int limit, const Use& use) {
  return ofBag(path_, [&] { return useAll(limit, use); });
}

int BagRecording::useAll(int limit, const Use& use) {
  std::map<ros::Time, Part> waiting;
  StampFilter<Part> filter;
  PairDecoder decoder;
  int unpaired = 0, refused = 0;
  std::string problem = "no four stamps agree";
  used_.clear();
  const auto isEnough = [&] { return static_cast<int>(used_.size()) == limit; };

  const auto process = [&](const Part& pair) {
    const ros::Time stamp = pair.messages.left_image->header.stamp;
    try {
      const DecodedPair decoded = decoder.decode(pair.messages);  // whose images are the messages'
      use(recordedPair(decoded, pair.messages, nanoseconds(stamp)));
      decoder.accept(decoded.camera);
      used_.push_back({stamp, pair.recorded});
    } catch (const std::invalid_argument& e) {
      ++refused;
      problem = e.what();
    }
  };
  const auto filterStamps = [&](const Part& pair, const ros::Time& arrival) {
    for (const auto& passed :
         filter.add(pair, nanoseconds(pair.messages.left_image->header.stamp), nanoseconds(arrival))) {
      if (passed.source_restarts > 0)
        throw std::runtime_error("stamps jump back for good: these are several recordings, one bag for each is needed");
      if (!isEnough()) process(passed.item);
    }
  };

  rosbag::View view(bag_, rosbag::TopicQuery(std::vector<std::string>(topics_.begin(), topics_.end())));
  for (auto instance = view.begin(); instance != view.end() && !isEnough(); ++instance) {
    const StereoMessage message = readStereoMessage(*instance, topics_);
    const ros::Time stamp = message.header().stamp;
    if (const std::string why = whyUnusable(stamp); !why.empty()) {
      ++unpaired;
      problem = instance->getTopic() + ": " + why;
      continue;
    }
    const auto waits =
        std::find_if(waiting.begin(), waiting.end(), [&](const auto& p) { return areOne(p.first, stamp); });
    const auto found = waits != waiting.end() ? waits : waiting.emplace(stamp, Part()).first;
    Part& pair = found->second;
    put(message, pair.messages);
    pair.recorded[message.input] = instance->getTime();
    if (isComplete(pair.messages)) {
      filterStamps(pair, instance->getTime());
      const auto end = std::next(found);
      unpaired += static_cast<int>(std::distance(waiting.begin(), end)) - 1;
      waiting.erase(waiting.begin(), end);
    } else if (waiting.size() > kWaiting) {
      ++unpaired;
      waiting.erase(waiting.begin());
    }
  }
  if (used_.empty()) throw std::runtime_error("'" + path_ + "': no pair can be used: " + problem);
  return unpaired + static_cast<int>(waiting.size() + filter.dropped()) + refused;
}

void BagRecording::forEachBackwards(const Use& use) const {
  PairDecoder decoder;
  const std::int64_t ends = nanoseconds(used_.front().stamp) + nanoseconds(used_.back().stamp);
  for (auto pair = used_.rbegin(); pair != used_.rend(); ++pair) {
    const StereoPairMessages messages = read(*pair);
    const DecodedPair decoded = decoder.decode(messages);
    use(recordedPair(decoded, messages, ends - nanoseconds(pair->stamp)));
    decoder.accept(decoded.camera);
  }
}

ArrivalFindings BagRecording::arrivals(const std::string& base_frame) const {
  CameraInput input(topics_, [](const StereoPairMessages&) {});
  input.addAll(bag_, topics_);
  return input.findings(base_frame);
}

/// By the bag's index.
StereoPairMessages BagRecording::read(const Used& pair) const {
  StereoPairMessages messages;
  for (std::size_t input = 0; input < topics_.size(); ++input) {
    rosbag::View view(bag_, rosbag::TopicQuery(topics_[input]), pair.recorded[input], pair.recorded[input]);
    for (const rosbag::MessageInstance& instance : view)
      if (const StereoMessage message = readStereoMessage(instance, topics_);
          areOne(message.header().stamp, pair.stamp))
        put(message, messages);
  }
  return messages;
}

}  // namespace sdvo
