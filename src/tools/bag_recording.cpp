#include "bag_recording.hpp"

#include <nav_msgs/Odometry.h>
#include <rosbag/view.h>

#include <boost/make_shared.hpp>
#include <stdexcept>

#include "../common/stamp_filter.hpp"
#include "../messages/stamps.hpp"
#include "pair_reader.hpp"

namespace sdvo {

BagRecording::BagRecording(const std::string& path, const StereoSource& source)
    : path_(path), fov_(source.fov), infos_(infosOf(source)) {
  openBag(path, bag_);
  topics_ = ofBag(path, [&] { return topicsIn(bag_, source); });
}

int BagRecording::size() const {
  return static_cast<int>(rosbag::View(bag_, rosbag::TopicQuery(topics_[0])).size());
}

int BagRecording::forEach(int limit, const Use& use, const Refuse& refuse) {
  return ofBag(path_, [&] { return useAll(limit, use, refuse); });
}

int BagRecording::useAll(int limit, const Use& use, const Refuse& refuse) {
  StampFilter<ArrivedPair> filter;
  PairReader reader(topics_, fov_);
  int refused = 0;
  std::string problem;
  used_.clear();
  const auto isEnough = [&] { return static_cast<int>(used_.size()) == limit; };
  const auto process = [&](const ArrivedPair& pair) {
    try {
      use(reader.read(pair.messages, nanoseconds(pair.stamps[0])));
      used_.push_back({pair.stamps, pair.arrivals});
    } catch (const std::invalid_argument& e) {
      ++refused;
      problem = e.what();
      if (refuse) refuse(problem);
    }
  };
  input_ = std::make_unique<CameraInput>(topics_, infos_, [&](const ArrivedPair& pair) {
    for (const auto& passed : filter.add(pair, nanoseconds(pair.stamps[0]), nanoseconds(pair.complete))) {
      if (passed.source_restarts > 0 && !refuse)
        throw std::runtime_error("stamps jump back for good: these are several recordings, one bag for each is needed");
      if (passed.source_restarts == 0 && !isEnough()) process(passed.item);
    }
  });

  std::vector<std::string> wanted(topics_.begin(), topics_.end());
  wanted.insert(wanted.end(), {"/tf", "/tf_static"});
  rosbag::View view(bag_, rosbag::TopicQuery(wanted));
  view.addQuery(bag_, rosbag::TypeQuery(ros::message_traits::datatype<nav_msgs::Odometry>()));  // name the base
  for (auto instance = view.begin(); instance != view.end() && !isEnough(); ++instance) input_->add(*instance);
  if (used_.empty() && !refuse)
    throw std::runtime_error("'" + path_ +
                             "': no pair can be used: " + (problem.empty() ? input_->problem() : problem));
  return input_->unused() + static_cast<int>(filter.dropped()) + refused;
}

void BagRecording::forEachBackwards(const Use& use) const {
  PairReader reader(topics_, fov_);
  const std::int64_t ends = nanoseconds(used_.front().stamps[0]) + nanoseconds(used_.back().stamps[0]);
  for (auto pair = used_.rbegin(); pair != used_.rend(); ++pair)
    use(reader.read(read(*pair), ends - nanoseconds(pair->stamps[0])));
}

/// By the bag's index.
StereoPairMessages BagRecording::read(const Used& pair) const {
  StereoPairMessages messages;
  for (std::size_t input = 0; input < topics_.size(); ++input) {
    if (infos_ && input >= 2) {
      (input == 2 ? messages.left_info : messages.right_info) =
          boost::make_shared<sensor_msgs::CameraInfo>((*infos_)[input - 2]);
      continue;
    }
    rosbag::View view(bag_, rosbag::TopicQuery(topics_[input]), pair.recorded[input], pair.recorded[input]);
    for (const rosbag::MessageInstance& instance : view) {
      const StereoMessage message = readStereoMessage(instance, topics_);
      if (message.header.stamp != pair.stamps[input]) continue;
      if (message.image)
        (input == 0 ? messages.left_image : messages.right_image) = message.image;
      else
        (input == 2 ? messages.left_info : messages.right_info) = message.info;
    }
  }
  return messages;
}

}  // namespace sdvo
