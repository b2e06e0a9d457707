#include "whole_file.hpp"

#include <filesystem>
#include <stdexcept>

namespace fs = std::filesystem;

namespace sdvo {

void writeWhole(const std::string& path, const std::function<void(const std::string& partial)>& write) {
  const auto fail = [&](const std::string& why) { throw std::runtime_error("'" + path + "': " + why); };
  if (!fs::path(path).is_absolute()) fail("the path must be absolute");
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) fail("it is no regular file");
  const std::string partial = path + ".partial";
  try {
    write(partial);
    fs::rename(partial, path);
  } catch (const fs::filesystem_error& e) {
    fs::remove(partial, ignored);
    fail("cannot be written: " + e.code().message());
  } catch (const std::exception& e) {
    fs::remove(partial, ignored);
    fail(std::string("cannot be written: ") + e.what());
  }
}

}  // namespace sdvo
