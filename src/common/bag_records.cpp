#include "bag_records.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>

namespace sdvo {
namespace {

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

}  // namespace

void readBag(Bytes bytes, const std::function<void(const BagMessage&)>& use) {
  constexpr Bytes kMagic = "#ROSBAG V2.0\n";
  if (bytes.substr(0, kMagic.size()) != kMagic) throw std::invalid_argument("it is no bag of version 2.0");
  std::map<Bytes, Fields> connections;
  readRecords(bytes.substr(kMagic.size()), false, connections, use);
}

}  // namespace sdvo
