#pragma once

#include <functional>
#include <memory>
#include <string>

namespace sdvo {

/// A file that appears whole or not at all. Until commit() the partial one beside it is there to be written, of this
/// object alone, and goes with it. Links stay and lead to the new file. Throws std::runtime_error that names the file,
/// and leaves it as it was, when it cannot be written, the path is not absolute or leads to something else than a file.
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
