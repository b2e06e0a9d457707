#include "places_file.hpp"

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <algorithm>
#include <boost/interprocess/file_mapping.hpp>
#include <boost/interprocess/mapped_region.hpp>
#include <cstdint>
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

/// A message of a bag, which refers to its bytes.
struct BagMessage {
  std::map<std::string_view, std::string_view> connection;  ///< topic, type, md5sum
  std::string_view data;
};

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
    const std::size_t equals = std::min(field.find('='), field.size());
    fields[field.substr(0, equals)] = field.substr(std::min(equals + 1, field.size()));
  }
  return fields;
}

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

/// Hands over the messages of a bag (version 2.0, without compression) in the order of its bytes. rosbag's own reader
/// trusts every length, count and offset that a file announces: it allocates as much, or reads beyond what it holds.
/// Throws std::invalid_argument where they do not fit into each other.
void readBag(Bytes bytes, const std::function<void(const BagMessage&)>& use) {
  constexpr Bytes kMagic = "#ROSBAG V2.0\n";
  if (bytes.substr(0, kMagic.size()) != kMagic) throw std::invalid_argument("it is no bag of version 2.0");
  std::map<Bytes, Fields> connections;
  readRecords(bytes.substr(kMagic.size()), false, connections, use);
}

namespace msgs = stereo_descriptor_vo;

constexpr const char* kPlaceTopic = "place";
constexpr const char* kGraphTopic = "map_graph";
constexpr const char* kOldPlace = "d90a2505b9172820b06c0867769c61b0";  // of 0.1.0: features end before right_delay

/// Refuses an array longer than the rest of its message; ROS' own stream makes room for it before it looks.
struct CheckedStream : ros::serialization::Stream {
  static const ros::serialization::StreamType stream_type = ros::serialization::stream_types::Input;

  explicit CheckedStream(std::string_view bytes)
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
  auto& connection = in_bag.connection;
  if (connection["md5sum"] != ros::message_traits::md5sum<Message>())
    throw std::invalid_argument("its messages on " + std::string(connection["topic"]) +
                                " are of another type or version of this package (" + std::string(connection["type"]) +
                                ", " + std::string(connection["md5sum"]) + ")");
  Message message;
  CheckedStream(in_bag.data).next(message);
  return message;
}

void readFile(const std::string& path, const std::function<void(const BagMessage&)>& use) {
  namespace ipc = boost::interprocess;
  if (!std::filesystem::is_regular_file(path)) throw std::invalid_argument("there is no such file");
  if (std::filesystem::is_empty(path)) throw std::invalid_argument("it is empty");
  const ipc::mapped_region region(ipc::file_mapping(path.c_str(), ipc::read_only), ipc::read_only);
  readBag({static_cast<const char*>(region.get_address()), region.get_size()}, use);
}

/// Also one that a version with other messages wrote. Nothing is lost with a file that is empty.
bool isOfPlaces(const std::string& path) try {
  if (std::filesystem::is_regular_file(path) && std::filesystem::is_empty(path)) return true;
  bool found = false;
  readFile(path, [&](BagMessage message) {
    found |= message.connection["type"] == ros::message_traits::datatype<msgs::MapGraph>();
  });
  return found;
} catch (const std::exception&) {
  return false;
}

SavedPlaces read(const std::string& path, const PoseGraphOptions& options) {
  std::vector<Place> places;
  std::optional<PoseGraph> graph;
  std::optional<ros_conversions::FeatureStream> stream;
  readFile(path, [&](BagMessage message) {
    const std::string_view topic = message.connection["topic"];
    if (topic == kPlaceTopic) {
      std::string completed;
      if (message.connection["md5sum"] == kOldPlace) {
        completed.assign(message.data).append(sizeof(float), '\0');
        message.connection["md5sum"] = ros::message_traits::md5sum<msgs::Place>();
        message.data = completed;
      }
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
                const std::string& path, bool overwrite) {
  if (!overwrite && std::filesystem::is_regular_file(path) && !isOfPlaces(path))
    throw std::runtime_error(
        "'" + path + "' is no file of save_places: give another path, or set place_recognition/overwrite at the start");
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
  return read(path, options);
} catch (const std::exception& e) {
  throw std::runtime_error("'" + path + "': " + e.what());
}

}  // namespace sdvo
