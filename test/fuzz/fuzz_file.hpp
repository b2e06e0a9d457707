#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>

#include "../temporary_folder.hpp"

namespace sdvo {

/// Writes what the fuzzer came up with into a file of a temporary folder that lasts as long as the process, and returns
/// the file's path.
inline std::string fuzzedFile(const std::string& name, const std::uint8_t* data, std::size_t size) {
  static const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / name;
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return path.string();
}

}  // namespace sdvo
