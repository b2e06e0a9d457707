#include "places_file.hpp"

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <boost/interprocess/file_mapping.hpp>
#include <boost/interprocess/mapped_region.hpp>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "output_files.hpp"

namespace sdvo {
namespace {

namespace msgs = stereo_descriptor_vo;

constexpr const char* kPlaceTopic = "place";
constexpr const char* kGraphTopic = "map_graph";

// A bag of version 2.0, read in the order of its bytes. rosbag's own reader trusts every length, count and offset that
// a file announces: it allocates as much, or reads beyond what it holds.

using Bytes = std::string_view;
using Fields = std::map<Bytes, Bytes>;

/// The next bytes, as many as the length before them (little endian) says.
Bytes take(Bytes& from) {
  std::uint32_t length = 0;
  if (from.size() >= sizeof length) std::memcpy(&length, from.data(), sizeof length);
  if (from.size() < sizeof length + length) throw std::invalid_argument("it ends early, or a length in it is wrong");
  const Bytes taken = from.substr(sizeof length, length);
  from.remove_prefix(sizeof length + length);
  return taken;
}

Fields takeFields(Bytes header) {
  Fields fields;
  while (!header.empty()) {
    const Bytes field = take(header);
    fields[field.substr(0, field.find('='))] = field.substr(std::min(field.size(), field.find('=') + 1));
  }
  return fields;
}

struct BagMessage {
  Fields connection;  ///< topic, type, md5sum
  Bytes data;
};

void readRecords(Bytes records, bool in_chunk, std::map<Bytes, Fields>& connections,
                 const std::function<void(const BagMessage&)>& use) {
  constexpr Bytes kMessage = "\x02", kChunk = "\x05", kConnection = "\x07";
  while (!records.empty()) {
    Fields header = takeFields(take(records));
    const Bytes data = take(records), kind = header["op"];
    if (kind == kChunk && (in_chunk || header["compression"] != "none"))
      throw std::invalid_argument("its chunks are compressed: `rosbag decompress` makes a file that can be read");
    if (kind == kChunk) readRecords(data, true, connections, use);
    if (kind == kConnection) (connections[header["conn"]] = takeFields(data))["topic"] = header["topic"];
    if (kind == kMessage) use({connections[header["conn"]], data});
  }
}

/// Refuses an array longer than the rest of its message; ROS' own stream makes room for it before it looks.
struct CheckedStream : ros::serialization::Stream {
  static const ros::serialization::StreamType stream_type = ros::serialization::stream_types::Input;

  explicit CheckedStream(Bytes bytes)
      : Stream(reinterpret_cast<std::uint8_t*>(const_cast<char*>(bytes.data())),
               static_cast<std::uint32_t>(bytes.size())) {}

  template <class T>
  void next(T& value) {
    ros::serialization::deserialize(*this, value);
  }

  template <class T, class Allocator>
  void next(std::vector<T, Allocator>& array) {
    ros::serialization::IStream ahead(getData(), getLength());
    std::uint32_t length = 0;
    ahead.next(length);
    const std::uint64_t least = ros::serialization::serializationLength(T());  // of one
    if (length * least > ahead.getLength()) ros::serialization::throwStreamOverrun();
    ros::serialization::deserialize(*this, array);
  }
};

/// Throws std::invalid_argument for a message of another definition.
template <class Message>
Message parse(BagMessage in_bag) {
  Fields& connection = in_bag.connection;
  if (connection["md5sum"] != ros::message_traits::md5sum<Message>())
    throw std::invalid_argument("its messages on " + std::string(connection["topic"]) +
                                " are of another type or version of this package (" + std::string(connection["type"]) +
                                ", " + std::string(connection["md5sum"]) + ")");
  Message message;
  CheckedStream(in_bag.data).next(message);
  return message;
}

SavedPlaces read(const std::string& path, const PoseGraphOptions& options) {
  namespace ipc = boost::interprocess;
  constexpr Bytes kMagic = "#ROSBAG V2.0\n";
  if (std::filesystem::file_size(path) < kMagic.size()) throw std::invalid_argument("it is no bag");
  const ipc::mapped_region region(ipc::file_mapping(path.c_str(), ipc::read_only), ipc::read_only);
  const Bytes bytes(static_cast<const char*>(region.get_address()), region.get_size());
  if (bytes.substr(0, kMagic.size()) != kMagic) throw std::invalid_argument("it is no bag of version 2.0");
  std::vector<Place> places;
  std::optional<PoseGraph> graph;
  std::optional<ros_conversions::FeatureStream> stream;
  std::map<Bytes, Fields> connections;
  readRecords(bytes.substr(kMagic.size()), false, connections, [&](BagMessage message) {
    const Bytes topic = message.connection["topic"];
    if (topic == kPlaceTopic) {
      const auto place = parse<msgs::Place>(message);
      places.push_back(ros_conversions::fromMessage(place));
      if (!stream) stream = ros_conversions::streamOf(place.features);
      const StereoFeatures &first = places.front().features, &last = places.back().features;
      if (!first.camera.isLike(last.camera))
        throw std::invalid_argument("its places " + std::to_string(places.front().id) + " and " +
                                    std::to_string(places.back().id) + " are of different cameras");
    } else if (topic == kGraphTopic) {
      graph = ros_conversions::fromMessage(parse<msgs::MapGraph>(message), options);
    }
  });
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
