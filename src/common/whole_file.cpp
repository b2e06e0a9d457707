#include "whole_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>
#include <system_error>

namespace fs = std::filesystem;

namespace sdvo {

namespace {

void check(bool succeeded) {
  if (!succeeded) throw std::system_error(errno, std::generic_category());
}

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

template <class Action>
void ofFile(const std::string& path, const Action& action) try {
  action();
} catch (const std::system_error& e) {
  throw std::runtime_error("'" + path + "': cannot be written: " + e.code().message());
} catch (const std::exception& e) {
  throw std::runtime_error("'" + path + "': cannot be written: " + e.what());
}

}  // namespace

/// A file descriptor, closed by the destructor.
class WholeFile::Descriptor {
 public:
  explicit Descriptor(int file) : file_(file) { check(file >= 0); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { ::close(file_); }
  /// Returns once the disk has what was written.
  void synchronise() const { check(::fsync(file_) == 0 || errno == EINVAL); }  // EINVAL: a file system without it
  void allow(mode_t mode) const { check(::fchmod(file_, mode) == 0); }
  /// Locks the file until it is closed, at the latest by the end of the process. False if another process has the lock.
  bool lock() const { return ::flock(file_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK; }
  bool hasName() const {
    struct stat status {};
    return ::fstat(file_, &status) == 0 && status.st_nlink > 0;
  }

 private:
  const int file_;
};

WholeFile::WholeFile(const std::string& path) : path_(path) {
  const auto fail = [&](const char* why) { throw std::runtime_error("'" + path + "': " + why); };
  if (!fs::path(path).is_absolute()) fail("the path must be absolute");
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) fail("it is no regular file");
  ofFile(path, [&] {
    final_ = followLinks(path);
    const std::string beside = final_ + ".partial-";
    for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(final_).parent_path(), ignored)) {
      const std::string name = entry.path().string();
      if (name.compare(0, beside.size(), beside) != 0 || !entry.is_regular_file(ignored)) continue;
      const int left = ::open(name.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
      if (left < 0) continue;
      const Descriptor held(left);
      if (held.lock()) fs::remove(name, ignored);
    }
    // open() gives the mode of any new file, 0666 less the umask. mkstemp() would give 0600, and the umask cannot be
    // read without changing it.
    std::random_device random;
    do {
      partial_ = beside + std::to_string(random());
      const int file = ::open(partial_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (file < 0 && errno == EEXIST) continue;
      file_ = std::make_unique<Descriptor>(file);
    } while (!file_ || !file_->lock() || !file_->hasName());  // another process may have removed it as a killed one's
  });
}

WholeFile::~WholeFile() {
  std::error_code ignored;
  if (file_) fs::remove(partial_, ignored);
}

void WholeFile::commit() {
  ofFile(path_, [this] {
    struct stat before {};
    if (::stat(final_.c_str(), &before) == 0) file_->allow(before.st_mode & 07777);
    file_->synchronise();
    fs::rename(partial_, final_);
    file_.reset();
    Descriptor(::open(fs::path(final_).parent_path().c_str(), O_RDONLY | O_DIRECTORY)).synchronise();
  });
}

void writeWhole(const std::string& path, const std::function<void(const std::string& partial)>& write) {
  WholeFile file(path);
  ofFile(path, [&] { write(file.partial()); });
  file.commit();
}

void writeWhole(const std::string& path, const std::string& content) {
  writeWhole(path, [&](const std::string& partial) {
    errno = 0;
    std::ofstream file(partial, std::ios::binary);
    file << content;
    file.close();
    if (!file) throw std::system_error(errno, std::generic_category());
  });
}

}  // namespace sdvo
