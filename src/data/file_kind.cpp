#include "file_kind.hpp"

#include <algorithm>
#include <cctype>
#include <fstream>

namespace sdvo {
namespace {

/// Lower-case first bytes, and what they are of.
const struct {
  std::string begin;
  const char* words;
} kOtherKinds[] = {
    {"version https://git-lfs", "a pointer of Git-LFS, not the file itself: git lfs pull"},
    {"<!doctype html", "an HTML page, not the file itself: download it anew, the server may want a login"},
    {"<html", "an HTML page, not the file itself: download it anew, the server may want a login"},
    {"sqlite format 3", "a bag of ROS 2 (SQLite): convert it, for example by rosbags-convert of the package rosbags"},
    {"\x89mcap", "an MCAP file, as of ROS 2: convert it, for example by rosbags-convert of the package rosbags"},
    {"#rosbag v1", "a bag of an ancient ROS: rosbag fix"},
    {"pk\x03\x04", "a ZIP archive: unpack it"},
    {"\x1f\x8b", "a gzip archive: unpack it"},
    {"bzh", "a bzip2 archive: unpack it"},
    {"\xfd" "7zxz", "an xz archive: unpack it"},
    {"7z\xbc\xaf", "a 7-Zip archive: unpack it"},
    {"rar!", "a RAR archive: unpack it"},
    {"\x7f" "elf", "a program"},
    {"%pdf", "a PDF document"},
    {std::string(64, '\0'), "empty but for zeros, as after an interrupted copy: copy it again"},
};

}  // namespace

std::string otherKindOfBytes(const std::string& begin) {
  std::string lower = begin.substr(0, 3) == "\xef\xbb\xbf" ? begin.substr(3) : begin;
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) {
    return c < 128 ? static_cast<char>(std::tolower(c)) : static_cast<char>(c);
  });
  const bool is_binary = !lower.empty() && lower.front() == '\0';
  lower.erase(0, is_binary ? 0 : std::min(lower.find_first_not_of(" \t\r\n"), lower.size()));
  for (const auto& kind : kOtherKinds)
    if (lower.rfind(kind.begin, 0) == 0) return kind.words;
  return "";
}

std::string otherKindOf(const std::string& path) {
  std::string begin(128, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return otherKindOfBytes(begin);
}

}  // namespace sdvo
