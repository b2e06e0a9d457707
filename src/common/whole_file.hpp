#pragma once

#include <functional>
#include <memory>
#include <string>

namespace sdvo {

/// Writes a file as a whole or not at all. The caller writes the partial file beside it, and commit() puts that in its
/// place; without commit() the destructor removes it. Symbolic links on the path stay links. If the file cannot be
/// written, or the path is not absolute or not of a regular file, throws std::runtime_error with the file's name and
/// leaves the file as it was.
class WholeFile {
 public:
  /// Removes partial files of processes that were killed.
  explicit WholeFile(const std::string& path);
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  const std::string& partial() const { return partial_; }
  /// Returns once the disk has it.
  void commit();

 private:
  class Descriptor;

  const std::string path_;
  std::string final_, partial_;
  std::unique_ptr<Descriptor> file_;
};

/// Has `write` write the partial file; it throws when it cannot.
void writeWhole(const std::string& path, const std::function<void(const std::string& partial)>& write);
void writeWhole(const std::string& path, const std::string& content);

}  // namespace sdvo
