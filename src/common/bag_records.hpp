#pragma once

#include <functional>
#include <map>
#include <string_view>

namespace sdvo {

/// A message of a bag, which refers to its bytes.
struct BagMessage {
  std::map<std::string_view, std::string_view> connection;  ///< topic, type, md5sum
  std::string_view data;
};

/// Hands over the messages of a bag (version 2.0, without compression) in the order of its bytes. rosbag's own reader
/// trusts every length, count and offset that a file announces: it allocates as much, or reads beyond what it holds.
/// Throws std::invalid_argument where they do not fit into each other.
void readBag(std::string_view bytes, const std::function<void(const BagMessage&)>& use);

}  // namespace sdvo
