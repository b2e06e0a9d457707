#include "image_file.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <vector>

#include "file_kind.hpp"

namespace fs = std::filesystem;

namespace sdvo {
namespace {

/// Walks the chunks of a PNG; false when the file ends before its IEND chunk does.
bool isCompletePng(const std::string& bytes) {
  const auto byte = [&](std::size_t i) { return std::size_t{static_cast<unsigned char>(bytes[i])}; };
  std::size_t at = 8;  // behind the signature
  while (at + 12 <= bytes.size()) {
    const std::size_t length = (byte(at) << 24) | (byte(at + 1) << 16) | (byte(at + 2) << 8) | byte(at + 3);
    if (length > bytes.size() - at - 12) return false;
    if (bytes.compare(at + 4, 4, "IEND") == 0) return true;
    at += 12 + length;
  }
  return false;
}

/// The last scan of a JPEG has its end. The markers do not occur in its data, but in those of a thumbnail before it.
bool isCompleteJpeg(const std::string& bytes) {
  const std::size_t scan = bytes.rfind("\xff\xda"), end = bytes.rfind("\xff\xd9");
  return scan != std::string::npos && end != std::string::npos && end > scan;
}

const struct {
  std::string begin;
  bool (*isComplete)(const std::string& bytes);
} kImageKinds[] = {{"\x89PNG\r\n\x1a\n", isCompletePng}, {"\xff\xd8\xff", isCompleteJpeg}};

}  // namespace

bool isImageName(const std::string& name) {
  std::string ending = fs::path(name).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return (ending == ".png" || ending == ".jpg" || ending == ".jpeg") && name.front() != '.';
}

cv::Mat readGreyImage(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || fs::is_directory(path))
    throw std::runtime_error("cannot read image '" + path + "': does it exist, may I read it?");
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const auto kind = std::find_if(std::begin(kImageKinds), std::end(kImageKinds),
                                 [&](const auto& k) { return bytes.rfind(k.begin, 0) == 0; });
  if (kind == std::end(kImageKinds)) {
    const std::string other = bytes.empty() ? "empty: copy it again" : otherKindOfBytes(bytes.substr(0, 128));
    throw std::runtime_error("image '" + path + "' is " + (other.empty() ? "neither a PNG nor a JPEG file" : other));
  }
  if (!kind->isComplete(bytes)) throw std::runtime_error("image '" + path + "' is truncated: copy it again");
  cv::Mat image;
  try {
    image = cv::imdecode(std::vector<char>(bytes.begin(), bytes.end()), cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) throw std::runtime_error("image '" + path + "' is damaged and cannot be decoded: copy it again");
  return image;
}

void writeImage(const std::string& path, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  // OpenCV's own settings are its fastest, one filter and run lengths; naming a level makes it try all filters. Its
  // imwrite() does not notice a full disk.
  const bool is_encoded = cv::imencode(fs::path(path).extension().string(), image, bytes);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!is_encoded || !file) throw std::runtime_error("cannot write image '" + path + "': is the disk full?");
}

}  // namespace sdvo
