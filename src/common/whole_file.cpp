#include "whole_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <random>
#include <stdexcept>
#include <string>
#include <system_error>

namespace fs = std::filesystem;

namespace sdvo {

namespace {

void check(bool succeeded) {
  if (!succeeded) throw std::system_error(errno, std::generic_category());
}

/// Closed with its owner; synchronise() returns once the disk has what was written.
class Descriptor {
 public:
  explicit Descriptor(int file) : file_(file) { check(file >= 0); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { ::close(file_); }
  void synchronise() const { check(::fsync(file_) == 0 || errno == EINVAL); }  // EINVAL: a file system without it
  void allow(mode_t mode) const { check(::fchmod(file_, mode) == 0); }

 private:
  const int file_;
};

/// The file that `path` leads to, over links that may lead to nothing yet.
fs::path followLinks(fs::path path) {
  constexpr int kMostLinks = 40;  // the kernel's own limit
  std::error_code ignored;
  for (int links = 0; fs::is_symlink(path, ignored); ++links) {
    if (links == kMostLinks) throw std::system_error(ELOOP, std::generic_category());
    path = path.parent_path() / fs::read_symlink(path);
  }
  return path;
}

/// A new file beside `path`, whose name it appends to. Its mode is that of any program's new file: mkstemp's is not,
/// and the process's umask can only be read by changing it.
int create(std::string& path) {
  std::random_device random;
  const std::string beside = path + ".partial-";
  for (;;) {
    path = beside + std::to_string(random());
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0 || errno != EEXIST) return file;
  }
}

void replace(const fs::path& path, const std::function<void(const std::string& partial)>& write) {
  std::string partial = path.string();
  const Descriptor file(create(partial));
  try {
    write(partial);
    struct stat before {};
    if (::stat(path.c_str(), &before) == 0) file.allow(before.st_mode & 07777);
    file.synchronise();
    fs::rename(partial, path);
  } catch (...) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw;
  }
  Descriptor(::open(path.parent_path().c_str(), O_RDONLY | O_DIRECTORY)).synchronise();
}

}  // namespace

void writeWhole(const std::string& path, const std::function<void(const std::string& partial)>& write) {
  const auto fail = [&](const std::string& why) { throw std::runtime_error("'" + path + "': " + why); };
  if (!fs::path(path).is_absolute()) fail("the path must be absolute");
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) fail("it is no regular file");
  try {
    replace(followLinks(path), write);
  } catch (const std::system_error& e) {
    fail("cannot be written: " + e.code().message());
  } catch (const std::exception& e) {
    fail(std::string("cannot be written: ") + e.what());
  }
}

}  // namespace sdvo
