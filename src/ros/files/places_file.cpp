#include "places_file.hpp"

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "output_files.hpp"

namespace sdvo {
namespace {

using Bytes = std::string_view;
using Fields = std::map<Bytes, Bytes>;

struct Connection {
  std::string topic, type, md5sum;
};

/// A message of a bag; `data` points into the bag's bytes.
struct BagMessage {
  Connection connection;
  Bytes data;
};

/// Returns whether to go on with the next message.
using UseMessage = std::function<bool(const BagMessage&)>;

/// Bytes of a file that may change while it is read: at most as many as it had at first, and an error if some are
/// missing.
struct FileBytes {
  explicit FileBytes(const std::string& path)
      : file(path, std::ios::binary), left(static_cast<std::size_t>(std::filesystem::file_size(path))) {}
  bool empty() const { return left == 0; }

  std::ifstream file;
  std::size_t left;  ///< B
};

void require(bool holds) {
  if (!holds) throw std::invalid_argument("it ends early, or a length in it is wrong");
}

Bytes takeBytes(Bytes& from, std::size_t count) {
  require(count <= from.size());
  const Bytes taken = from.substr(0, count);
  from.remove_prefix(count);
  return taken;
}

std::string takeBytes(FileBytes& from, std::size_t count) {
  require(count <= from.left);
  from.left -= count;
  std::string taken(count, '\0');
  require(static_cast<bool>(from.file.read(taken.data(), static_cast<std::streamsize>(count))));
  return taken;
}

/// The next bytes. Their number stands before them (little endian).
template <class Source>
auto take(Source& from) {
  std::uint32_t length = 0;
  const auto number = takeBytes(from, sizeof length);
  std::memcpy(&length, number.data(), sizeof length);
  return takeBytes(from, length);
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

/// False if `use` ended the reading.
template <class Source>
bool readRecords(Source records, bool in_chunk, std::map<std::string, Connection>& connections, const UseMessage& use) {
  constexpr Bytes kMessage = "\x02", kChunk = "\x05", kConnection = "\x07";
  while (!records.empty()) {
    const auto head = take(records), data = take(records);
    Fields header = takeFields(head);
    const Bytes kind = header["op"];
    const std::string number(header["conn"]);
    if (kind == kChunk && (in_chunk || header["compression"] != "none"))
      throw std::invalid_argument("its chunks are compressed: `rosbag decompress` makes a file that can be read");
    if (kind == kChunk && !readRecords(Bytes(data), true, connections, use)) return false;
    if (kind == kMessage && !use({connections[number], data})) return false;
    if (kind != kConnection) continue;
    Fields fields = takeFields(data);
    connections[number] = {std::string(header["topic"]), std::string(fields["type"]), std::string(fields["md5sum"])};
  }
  return true;
}

namespace msgs = stereo_descriptor_vo;

constexpr const char* kPlaceTopic = "place";
constexpr const char* kGraphTopic = "map_graph";
constexpr const char* kOldPlace = "d90a2505b9172820b06c0867769c61b0";  // MD5 in 0.1.0

/// Refuses an array longer than the rest of its message. ROS' own stream allocates it before it checks.
struct CheckedStream : ros::serialization::Stream {
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
Message parse(const BagMessage& in_bag) {
  const Connection& connection = in_bag.connection;
  if (connection.md5sum != ros::message_traits::md5sum<Message>())
    throw std::invalid_argument("its messages on " + connection.topic +
                                " are of another type or version of this package (" + connection.type + ", " +
                                connection.md5sum + ")");
  Message message;
  CheckedStream(in_bag.data).next(message);
  return message;
}

/// Reads the messages of a bag (version 2.0, not compressed) in the order of its bytes. rosbag's own reader trusts
/// every length, count and offset in a file: a damaged one makes it allocate or read out of bounds. Throws
/// std::invalid_argument if lengths are inconsistent.
void readFile(const std::string& path, const UseMessage& use) {
  constexpr Bytes kMagic = "#ROSBAG V2.0\n";
  if (!std::filesystem::is_regular_file(path)) throw std::invalid_argument("there is no such file");
  FileBytes bytes(path);
  if (bytes.empty()) throw std::invalid_argument("it is empty");
  if (takeBytes(bytes, std::min(kMagic.size(), bytes.left)) != kMagic)
    throw std::invalid_argument("it is no bag of version 2.0");
  std::map<std::string, Connection> connections;
  readRecords(std::move(bytes), false, connections, use);
}

/// Whether a file may be replaced: by its first message it is one of places, of any version of this package, or it is
/// empty.
bool isOfPlaces(const std::string& path) try {
  if (std::filesystem::is_regular_file(path) && std::filesystem::is_empty(path)) return true;
  bool is_place = false;
  readFile(path, [&](const BagMessage& message) {
    is_place = message.connection.topic == kPlaceTopic &&
               message.connection.type == ros::message_traits::datatype<msgs::Place>();
    return false;
  });
  return is_place;
} catch (const std::exception&) {
  return false;
}

SavedPlaces read(const std::string& path) {
  std::vector<Place> places;
  std::optional<PoseGraph> graph;
  std::optional<ros_conversions::FeatureStream> stream;
  readFile(path, [&](BagMessage message) {
    const std::string& topic = message.connection.topic;
    if (topic == kPlaceTopic) {
      std::string completed;
      const bool is_old = message.connection.md5sum == kOldPlace;
      if (is_old) {
        completed.assign(message.data).append(2 * sizeof(float), '\0');  // right_delay and noise
        message.connection.md5sum = ros::message_traits::md5sum<msgs::Place>();
        message.data = completed;
      }
      const auto place = parse<msgs::Place>(message);
      if (is_old && place.features.descriptor == "freak")
        throw std::invalid_argument(
            "its FREAK descriptors are of 0.1.0, whose bits compare other fields: drive there again");
      places.push_back(ros_conversions::fromMessage(place));
      if (!stream) stream = ros_conversions::streamOf(place.features);
      const StereoFeatures &first = places.front().features, &last = places.back().features;
      if (!first.camera.isLike(last.camera))
        throw std::invalid_argument("its places " + std::to_string(places.front().id) + " and " +
                                    std::to_string(places.back().id) + " are of different cameras");
    } else if (topic == kGraphTopic) {
      graph = ros_conversions::fromMessage(parse<msgs::MapGraph>(message));
    }
    return true;
  });
  if (places.empty() || !graph)
    throw std::invalid_argument("it holds no places, or no graph of them: a file of save_places is expected");
  return {std::move(places), std::move(*graph), std::move(*stream)};
}

}  // namespace

void savePlaces(const SavedPlaces& saved, const std::string& robot, const std::string& map_frame,
                const std::string& path, bool overwrite) {
  if (!overwrite && std::filesystem::is_regular_file(path) && !isOfPlaces(path))
    throw std::runtime_error(
        "'" + path + "' is no file of save_places: give another path, or set place_recognition/overwrite at the start");
  writeWhole(path, [&](const std::string& partial) {
    OutputBag bag(partial);
    ros::Time newest = ros::TIME_MIN;
    ros_conversions::MapState map{saved.graph, {}};
    for (const Place& place : saved.places) {
      map.stamps[place.id] = place.features.stamp;
      const msgs::Place message = ros_conversions::toMessage(place, robot, saved.stream);
      newest = std::max(newest, message.features.header.stamp);
      bag->write(kPlaceTopic, message.features.header.stamp, message);
    }
    bag->write(kGraphTopic, newest, ros_conversions::toMessage(map, robot, map_frame));
    bag.close();
  });
}

SavedPlaces loadPlaces(const std::string& path) try {
  if (!std::filesystem::path(path).is_absolute()) throw std::invalid_argument("the path must be absolute");
  return read(path);
} catch (const std::exception& e) {
  throw std::runtime_error("'" + path + "': " + e.what());
}

}  // namespace sdvo
