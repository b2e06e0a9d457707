#include "bag_pairs.hpp"

#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

#include "../ros/stamps.hpp"

namespace sdvo {
namespace {

/// Stamps that wait for partners, of which none may ever be complete: images take memory.
constexpr std::size_t kWaiting = 100;

/// A message of the type that its topic must have.
template <class Message>
typename Message::ConstPtr instantiate(const rosbag::MessageInstance& instance) {
  const typename Message::ConstPtr message = instance.instantiate<Message>();
  if (!message)
    throw std::runtime_error(instance.getTopic() + " holds " + instance.getDataType() + ", expected " +
                             ros::message_traits::datatype<Message>());
  return message;
}

/// What one of the topics has of a pair: an image or a calibration.
struct Part {
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info;

  ros::Time stamp() const { return image ? image->header.stamp : info->header.stamp; }
};

Part readPart(const rosbag::MessageInstance& instance, std::size_t topic) {
  if (topic < 2) return {instantiate<sensor_msgs::Image>(instance), nullptr};
  return {nullptr, instantiate<sensor_msgs::CameraInfo>(instance)};
}

void put(const Part& part, std::size_t topic, StereoPairMessages& pair) {
  if (part.image)
    (topic == 0 ? pair.left_image : pair.right_image) = part.image;
  else
    (topic == 2 ? pair.left_info : pair.right_info) = part.info;
}

}  // namespace

BagPairs::BagPairs(const std::string& path, const std::string& camera)
    : topics_{camera + "/left/image_rect", camera + "/right/image_rect", camera + "/left/camera_info",
              camera + "/right/camera_info"},
      bag_(path, rosbag::bagmode::Read) {
  rosbag::View view(bag_);
  std::set<std::string> recorded;
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) recorded.insert(connection->topic);
  for (const std::string& topic : topics_)
    if (recorded.count(topic) == 0) throw std::runtime_error("there is no " + topic + " in it");
}

BagPairs::LeftOver BagPairs::forEach(const Use& use) const {
  struct Waiting {
    StereoPairMessages messages;
    Times recorded;
  };
  std::map<ros::Time, Waiting> waiting;
  LeftOver left_over{0, "no four stamps agree"};
  rosbag::View view(bag_, rosbag::TopicQuery(std::vector<std::string>(topics_.begin(), topics_.end())));
  for (const rosbag::MessageInstance& instance : view) {
    const auto topic =
        static_cast<std::size_t>(std::find(topics_.begin(), topics_.end(), instance.getTopic()) - topics_.begin());
    const Part part = readPart(instance, topic);
    const ros::Time stamp = part.stamp();
    if (const std::string problem = whyUnusable(stamp); !problem.empty()) {
      ++left_over.stamps;
      left_over.problem = instance.getTopic() + ": " + problem;
      continue;
    }
    auto& [pair, recorded] = waiting[stamp];
    put(part, topic, pair);
    recorded[topic] = instance.getTime();
    if (pair.left_image && pair.right_image && pair.left_info && pair.right_info) {
      use(pair, recorded, instance.getTime());
      const auto end = std::next(waiting.find(stamp));
      left_over.stamps += static_cast<int>(std::distance(waiting.begin(), end)) - 1;
      waiting.erase(waiting.begin(), end);
    } else if (waiting.size() > kWaiting) {
      ++left_over.stamps;
      waiting.erase(waiting.begin());
    }
  }
  left_over.stamps += static_cast<int>(waiting.size());
  return left_over;
}

StereoPairMessages BagPairs::read(const ros::Time& stamp, const Times& recorded) const {
  StereoPairMessages pair;
  for (std::size_t topic = 0; topic < topics_.size(); ++topic) {
    rosbag::View view(bag_, rosbag::TopicQuery(topics_[topic]), recorded[topic], recorded[topic]);
    bool found = false;
    for (auto instance = view.begin(); !found && instance != view.end(); ++instance) {
      const Part part = readPart(*instance, topic);
      found = part.stamp() == stamp;
      if (found) put(part, topic, pair);
    }
    if (!found) throw std::runtime_error(topics_[topic] + " has no message of a pair that was read before");
  }
  return pair;
}

}  // namespace sdvo
