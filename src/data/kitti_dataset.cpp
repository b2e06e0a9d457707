#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "../common/text.hpp"
#include "text_file.hpp"

namespace fs = std::filesystem;

namespace sdvo {
namespace {

std::string frameName(int i) {
  return kittiFrameName(i) + ".png";
}

/// Walks the chunks of a PNG; false when the file ends before its IEND chunk does.
bool isCompletePng(const std::vector<unsigned char>& bytes) {
  std::size_t at = 8;  // behind the signature
  while (at + 12 <= bytes.size()) {
    const std::size_t length = (std::size_t{bytes[at]} << 24) | (std::size_t{bytes[at + 1]} << 16) |
                               (std::size_t{bytes[at + 2]} << 8) | std::size_t{bytes[at + 3]};
    const std::string type(bytes.begin() + static_cast<std::ptrdiff_t>(at) + 4,
                           bytes.begin() + static_cast<std::ptrdiff_t>(at) + 8);
    if (length > bytes.size() - at - 12) return false;
    if (type == "IEND") return true;
    at += 12 + length;
  }
  return false;
}

/// Names of the PNG files in a directory, sorted. Names that begin with a dot are some file manager's, not images.
std::vector<std::string> listPngs(const std::string& directory) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    if (entry.path().extension() == ".png" && name.front() != '.') names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// Number of frames; throws when the files are not 000000.png, 000001.png … on both sides.
int countFrames(const std::string& left_directory, const std::string& right_directory) {
  const std::vector<std::string> left = listPngs(left_directory), right = listPngs(right_directory);
  if (left.empty()) throw std::runtime_error("directory '" + left_directory + "' has no PNG images");
  for (const auto& [names, directory] : {std::pair(left, left_directory), std::pair(right, right_directory)})
    for (std::size_t i = 0; i < std::max(left.size(), right.size()); ++i) {
      const std::string expected = frameName(static_cast<int>(i));
      if (i >= names.size() || names[i] != expected)
        throw std::runtime_error(text(0, "image '", directory, "/", expected, "' is missing ('", left_directory,
                                      "' has ", left.size(), " images, '", right_directory, "' has ", right.size(),
                                      "; frames are numbered from 000000.png)"));
    }
  return static_cast<int>(left.size());
}

/// A 3x4 projection matrix, row-major.
using Projection = std::vector<double>;

Projection readProjection(const std::string& path, const std::string& name) {
  std::optional<Projection> projection;
  readLines(path, false, [&](const std::string& line) {
    const std::vector<std::string> words = splitWords(line);
    if (projection || words.front() != name + ":") return;
    projection.emplace();
    for (std::size_t i = 1; i < words.size(); ++i) projection->push_back(parseNumber(words[i]));
    if (projection->size() != 12)
      throw std::invalid_argument(text(0, "expected 12 numbers after '", name, ":', found ", projection->size()));
  });
  if (!projection) throw std::runtime_error("file '" + path + "' has no line '" + name + ":'");
  return *projection;
}

/// Number of the left camera.
int firstCamera(KittiCameras cameras) {
  return cameras == KittiCameras::kColour ? 2 : 0;
}

std::vector<std::int64_t> readStamps(const std::string& path, int count) {
  std::vector<std::int64_t> stamps;
  readLines(path, true, [&](const std::string& line) {
    if (static_cast<int>(stamps.size()) == count)
      throw std::runtime_error(text(0, "file '", path, "' has more times than the ", count,
                                    " images: are images missing? An extract needs the times of its own images alone"));
    const std::vector<std::string> words = splitWords(line);
    if (words.size() != 1) throw std::invalid_argument("expected one time in seconds");
    const std::int64_t stamp = parseSeconds(words.front());
    if (!stamps.empty() && stamp <= stamps.back())
      throw std::invalid_argument("time " + words.front() + " s is not later than the one before");
    stamps.push_back(stamp);
  });
  if (static_cast<int>(stamps.size()) < count)
    throw std::runtime_error(text(0, "file '", path, "' has ", stamps.size(), " times for ", count, " images"));
  return stamps;
}

/// P0 and P1: equal pinhole cameras, the right one's offset is -fx * baseline.
std::string calibrationText(const StereoCamera& camera) {
  std::ostringstream lines = numberStream();
  for (int side = 0; side < 2; ++side) {
    const double offset = side == 0 ? 0.0 : -camera.fx * camera.baseline;
    lines << "P" << side << ":";
    for (const double element : {camera.fx, 0.0, camera.cx, offset, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0})
      lines << " " << element;
    lines << "\n";
  }
  return lines.str();
}

}  // namespace

StereoCamera readKittiCalibration(const std::string& path, KittiCameras cameras) {
  const int first = firstCamera(cameras);
  const std::string left_name = "P" + std::to_string(first), right_name = "P" + std::to_string(first + 1);
  const Projection left = readProjection(path, left_name);
  const Projection right = readProjection(path, right_name);
  if (!(left[0] > 0.0 && left[5] > 0.0))
    throw std::runtime_error("file '" + path + "': the focal lengths of " + left_name + " must be positive");
  for (const int i : {0, 1, 2, 4, 5, 6, 8, 9, 10}) {
    const bool must_vanish = i == 1 || i == 4 || i == 8 || i == 9;
    if (std::abs(left[i] - right[i]) > 1e-6 * left[0] || (must_vanish && left[i] != 0.0))
      throw std::runtime_error("file '" + path + "': " + left_name + " and " + right_name +
                               " do not belong to a rectified pair (equal pinhole cameras side by side)");
  }
  // The baseline is a difference: the offset of a colour pair's left camera is not zero.
  const StereoCamera camera{left[0], left[5], left[2], left[6], (left[3] - right[3]) / left[0], 0, 0};
  if (!(camera.baseline > 0.0))
    throw std::runtime_error(text(6, "file '", path, "': the baseline (difference of Tx / fx) is ", camera.baseline,
                                  " m but must be positive; ", left_name, " has fx = ", left[0], ", Tx = ", left[3],
                                  "; ", right_name, " has fx = ", right[0], ", Tx = ", right[3],
                                  " (are left and right swapped?)"));
  return camera;
}

cv::Mat readGreyPng(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || fs::is_directory(path))
    throw std::runtime_error("cannot read image '" + path + "': does it exist, may I read it?");
  const std::vector<unsigned char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::string signature = "\x89PNG\r\n\x1a\n";
  if (bytes.size() < signature.size() ||
      !std::equal(signature.begin(), signature.end(), bytes.begin(),
                  [](char a, unsigned char b) { return static_cast<unsigned char>(a) == b; })) {
    throw std::runtime_error("image '" + path + "' is not a PNG file");
  }
  if (!isCompletePng(bytes)) throw std::runtime_error("image '" + path + "' is truncated: copy it again");
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) throw std::runtime_error("image '" + path + "' is damaged and cannot be decoded: copy it again");
  return image;
}

KittiSequence::KittiSequence(const std::string& directory, KittiCameras cameras) : directory_(directory) {
  if (!fs::is_directory(directory)) {
    throw std::runtime_error("sequence directory '" + directory + "' does not exist or is not a directory");
  }
  const auto has = [&](const std::string& name) { return fs::is_directory(fs::path(directory) / name); };
  if (cameras == KittiCameras::kAny) {
    const bool grey = has("image_0") || has("image_1");
    if (!grey && !has("image_2") && !has("image_3")) {
      throw std::runtime_error("sequence directory '" + directory +
                               "' has neither image_0 and image_1 nor image_2 and image_3");
    }
    cameras = grey ? KittiCameras::kGrey : KittiCameras::kColour;
  }
  const int first = firstCamera(cameras);
  for (int side = 0; side < 2; ++side) {
    const std::string name = "image_" + std::to_string(first + side);
    if (!has(name)) throw std::runtime_error("sequence directory '" + directory + "' has no " + name);
    image_directories_[side] = (fs::path(directory) / name).string();
  }
  const int count = countFrames(image_directories_[0], image_directories_[1]);
  camera_ = readKittiCalibration((fs::path(directory) / "calib.txt").string(), cameras);
  stamps_ = readStamps((fs::path(directory) / "times.txt").string(), count);

  const cv::Mat image = readGreyPng(imagePath(0, 0));
  camera_.width = image.cols;
  camera_.height = image.rows;
}

ImagePair KittiSequence::load(int i) const {
  ImagePair pair{readGreyPng(imagePath(0, i)), readGreyPng(imagePath(1, i))};
  if (pair.left.size() != pair.right.size())
    throw std::runtime_error(text(0, "images '", imagePath(0, i), "' (", pair.left.cols, "x", pair.left.rows, ") and '",
                                  imagePath(1, i), "' (", pair.right.cols, "x", pair.right.rows, ") differ in size"));
  if (pair.left.cols != camera_.width || pair.left.rows != camera_.height)
    throw std::runtime_error(text(0, "image '", imagePath(0, i), "' is ", pair.left.cols, "x", pair.left.rows,
                                  " but the first one of '", directory_, "' is ", camera_.width, "x", camera_.height));
  return pair;
}

std::string KittiSequence::imagePath(int side, int i) const {
  return (fs::path(image_directories_[side]) / frameName(i)).string();
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

std::optional<std::string> findKittiPoses(const std::string& directory) {
  // The absolute path resolves "." and a trailing slash, either of which would hide the sequence's name.
  fs::path sequence = fs::absolute(directory).lexically_normal();
  if (sequence.filename().empty()) sequence = sequence.parent_path();
  const fs::path official =
      sequence.parent_path().parent_path() / "poses" / fs::path(sequence.filename().string() + ".txt");
  for (const fs::path& candidate : {sequence / "poses.txt", official}) {
    if (fs::is_regular_file(candidate)) return candidate.string();
  }
  return std::nullopt;
}

KittiWriter::KittiWriter(const std::string& directory) {
  fs::path path = fs::absolute(directory).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  final_ = path.string();
  partial_ = final_ + ".part";
  if (fs::exists(path) && !(fs::is_directory(path) && fs::is_empty(path)))
    throw std::runtime_error("output '" + directory + "' exists and is not empty: remove it or choose another");
  if (fs::exists(partial_)) throw std::runtime_error("'" + partial_ + "' is left from an interrupted run: remove it");
  std::error_code error;
  fs::create_directories(partial_, error);
  for (const char* name : {"image_0", "image_1"})
    if (!error) fs::create_directory(fs::path(partial_) / name, error);
  if (error) throw std::runtime_error("cannot create output '" + directory + "': " + error.message());
}

KittiWriter::~KittiWriter() {
  std::error_code ignored;
  if (!finished_) fs::remove_all(partial_, ignored);
}

void KittiWriter::writeImage(int side, int i, const cv::Mat& image) const {
  const fs::path path = fs::path(partial_) / ("image_" + std::to_string(side)) / (kittiFrameName(i) + ".png");
  sdvo::writeImage(path.string(), image);
}

void KittiWriter::finish(const StereoCamera& camera, const std::vector<std::int64_t>& stamps, const Trajectory& poses) {
  if (!poses.empty() && poses.size() != stamps.size())
    throw std::invalid_argument("a sequence of " + std::to_string(stamps.size()) + " pairs has " +
                                std::to_string(poses.size()) + " poses");
  const fs::path partial = partial_;
  writeTextFile(partial / "calib.txt", calibrationText(camera));
  std::string times;
  for (const std::int64_t stamp : stamps) times += formatSeconds(stamp) + "\n";
  writeTextFile(partial / "times.txt", times);
  if (!poses.empty()) writeKittiPoses((partial / "poses.txt").string(), poses);
  std::error_code error;
  fs::rename(partial, final_, error);
  if (error) throw std::runtime_error("cannot rename '" + partial_ + "' to '" + final_ + "': " + error.message());
  finished_ = true;
}

}  // namespace sdvo
