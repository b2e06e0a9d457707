#include "places_file.hpp"

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <utility>

#include "camera_conversions.hpp"
#include "output_files.hpp"

namespace sdvo {
namespace {

namespace msgs = stereo_descriptor_vo;

constexpr const char* kPlaceTopic = "place";
constexpr const char* kGraphTopic = "map_graph";

/// Throws std::invalid_argument for a message of another definition.
template <class Message>
typename Message::ConstPtr read(const rosbag::MessageInstance& instance) {
  const typename Message::ConstPtr message = instance.instantiate<Message>();
  if (!message)
    throw std::invalid_argument("its messages on " + instance.getTopic() +
                                " are of another type or version of this package (" + instance.getDataType() + ", " +
                                instance.getMD5Sum() + ")");
  return message;
}

SavedPlaces read(const std::string& path, const PoseGraphOptions& options) {
  rosbag::Bag bag(path, rosbag::bagmode::Read);
  std::vector<Place> places;
  std::optional<PoseGraph> graph;
  std::optional<ros_conversions::FeatureStream> stream;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag)) {
    if (instance.getTopic() == kPlaceTopic) {
      const msgs::Place::ConstPtr message = read<msgs::Place>(instance);
      places.push_back(ros_conversions::fromMessage(*message));
      if (!stream) stream = ros_conversions::streamOf(message->features);
      const StereoFeatures &first = places.front().features, &last = places.back().features;
      if (!isSameCamera(last.camera, first.camera))
        throw std::invalid_argument("its places " + std::to_string(places.front().id) + " and " +
                                    std::to_string(places.back().id) + " are of different cameras");
    } else if (instance.getTopic() == kGraphTopic) {
      graph = ros_conversions::fromMessage(*read<msgs::MapGraph>(instance), options);
    }
  }
  if (places.empty() || !graph)
    throw std::invalid_argument("it holds no places, or no graph of them: a file of save_places is expected");
  return {std::move(places), std::move(*graph), std::move(*stream)};
}

}  // namespace

void savePlaces(const std::vector<Place>& places, const ros_conversions::MapState& map,
                const ros_conversions::FeatureStream& stream, const std::string& robot, const std::string& map_frame,
                const std::string& path) {
  writeWhole(path, [&](const std::string& partial) {
    OutputBag bag(partial);
    ros::Time newest = ros::TIME_MIN;
    for (const Place& place : places) {
      const msgs::Place message = ros_conversions::toMessage(place, robot, stream);
      newest = std::max(newest, message.features.header.stamp);
      bag->write(kPlaceTopic, message.features.header.stamp, message);
    }
    bag->write(kGraphTopic, newest, ros_conversions::toMessage(map, robot, map_frame));
    bag.close();
  });
}

SavedPlaces loadPlaces(const std::string& path, const PoseGraphOptions& options) try {
  if (!std::filesystem::path(path).is_absolute()) throw std::invalid_argument("the path must be absolute");
  if (!std::filesystem::is_regular_file(path)) throw std::invalid_argument("there is no such file");
  return read(path, options);
} catch (const std::exception& e) {
  throw std::runtime_error("'" + path + "': " + e.what());
}

}  // namespace sdvo
