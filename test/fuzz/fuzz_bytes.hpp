#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

namespace sdvo {

/// A fuzzer's input. Its bytes are taken from the front, piece by piece; after its end come zeros.
class FuzzBytes {
 public:
  FuzzBytes(const std::uint8_t* data, std::size_t size) : next_(data), end_(data + size) {}

  /// Any bits: not-a-number and infinity, too.
  template <class Value>
  Value any() {
    static_assert(std::is_trivially_copyable<Value>::value, "its bits are written");
    Value value{};
    const std::size_t left = static_cast<std::size_t>(end_ - next_), size = left < sizeof(value) ? left : sizeof(value);
    if (size > 0) std::memcpy(&value, next_, size);
    next_ += size;
    return value;
  }

  bool flag() { return (any<std::uint8_t>() & 1) != 0; }

  /// From 0 to `last`.
  std::size_t upTo(std::size_t last) { return any<std::uint32_t>() % (last + 1); }

  template <class Value, std::size_t count>
  Value oneOf(const std::array<Value, count>& values) {
    return values[upTo(count - 1)];
  }

  std::string text(std::size_t longest) {
    std::string text(upTo(longest), ' ');
    for (char& letter : text) letter = any<char>();
    return text;
  }

 private:
  const std::uint8_t *next_, *end_;
};

}  // namespace sdvo
