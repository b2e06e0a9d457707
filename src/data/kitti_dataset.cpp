#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <iomanip>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "../common/text.hpp"
#include "image_file.hpp"
#include "stereo_rectification.hpp"
#include "text_file.hpp"

namespace fs = std::filesystem;

namespace sdvo {
namespace {

/// A 3x4 projection matrix, row-major, or other numbers.
using Numbers = std::vector<double>;

/// The numbers of the first line "name: …", if there is one.
std::optional<Numbers> readNumbers(const std::string& path, const std::string& name, std::size_t count) {
  std::optional<Numbers> numbers;
  readLines(path, false, [&](const std::string& line) {
    const std::vector<std::string> words = splitWords(line);
    if (numbers || words.front() != name + ":") return;
    numbers.emplace();
    for (std::size_t i = 1; i < words.size(); ++i) numbers->push_back(parseNumber(words[i]));
    if (numbers->size() != count)
      throw std::invalid_argument(text(0, "expected ", count, " numbers after '", name, ":', found ", numbers->size()));
  });
  return numbers;
}

/// How a data set lays out its rectified pairs: folders of images, and files of text. Null: the data set has no such
/// file; `camera` is then that of all its drives.
struct Layout {
  const char* name;
  std::array<const char*, 2> images;
  const char* calibration;
  std::array<const char*, 2> projections;  ///< names of lines of the calibration
  const char* times;
  StereoCamera camera = {};
};

constexpr Layout kLayouts[] = {
    {"KITTI", {"image_0", "image_1"}, "calib.txt", {"P0", "P1"}, "times.txt"},
    {"KITTI in colour", {"image_2", "image_3"}, "calib.txt", {"P2", "P3"}, "times.txt"},
    {"KITTI raw (drive_…_sync)",
     {"image_00/data", "image_01/data"},
     "calib_cam_to_cam.txt",
     {"P_rect_00", "P_rect_01"},
     "image_00/timestamps.txt"},
    {"KITTI raw in colour",
     {"image_02/data", "image_03/data"},
     "calib_cam_to_cam.txt",
     {"P_rect_02", "P_rect_03"},
     "image_02/timestamps.txt"},
    {"KITTI-360",
     {"image_00/data_rect", "image_01/data_rect"},
     "perspective.txt",
     {"P_rect_00", "P_rect_01"},
     "image_00/timestamps.txt"},
    {"TartanAir", {"image_left", "image_right"}, nullptr, {}, nullptr, {320.0, 320.0, 320.0, 240.0, 0.25, 640, 480}},
    {"TartanAir V2",
     {"image_lcam_front", "image_rcam_front"},
     nullptr,
     {},
     nullptr,
     {320.0, 320.0, 320.0, 320.0, 0.25, 640, 640}},
    {"Virtual KITTI 2",
     {"frames/rgb/Camera_0", "frames/rgb/Camera_1"},
     nullptr,
     {},
     nullptr,
     {725.0087, 725.0087, 620.5, 187.0, 0.532725, 1242, 375}},
    {"two folders", {"left", "right"}, "calib.txt", {"P0", "P1"}, "times.txt"},
};

bool hasOneOf(const fs::path& folder, const Layout& layout) {
  return fs::is_directory(folder / layout.images[0]) || fs::is_directory(folder / layout.images[1]);
}

const Layout& layoutOf(const std::string& directory, KittiCameras cameras) {
  if (cameras != KittiCameras::kAny) return kLayouts[cameras == KittiCameras::kColour ? 1 : 0];
  for (const Layout& layout : kLayouts)
    if (hasOneOf(directory, layout)) return layout;
  throw std::runtime_error("sequence directory '" + directory + "' has no pairs of images in a layout that is read: " +
                           kittiLayouts());
}

/// In the folder, above it (KITTI raw), or in KITTI-360's folder.
std::string findCalibration(const fs::path& folder, const std::string& name) {
  const fs::path absolute = fs::absolute(folder).lexically_normal() / "";  // ends with a slash
  for (const char* place : {"../", "../../calibration/"})
    if (const fs::path file = absolute / place / name; !fs::exists(folder / name) && fs::is_regular_file(file))
      return file.lexically_normal().string();
  if (!fs::exists(folder / name))
    throw std::runtime_error("there is no '" + (folder / name).string() + "', nor one above: copy it there, or give a --calibration (layouts: docs/tools.md)");
  return (folder / name).string();
}

/// The camera of both projection matrices, which have no image size.
StereoCamera cameraOf(const std::string& path, const std::array<const char*, 2>& names) {
  const auto read = [&](const char* name) {
    const auto projection = readNumbers(path, name, 12);
    if (!projection) throw std::runtime_error("file '" + path + "' has no line '" + name + ":'");
    return *projection;
  };
  const Numbers left = read(names[0]), right = read(names[1]);
  if (!(left[0] > 0.0 && left[5] > 0.0))
    throw std::runtime_error("file '" + path + "': the focal lengths of " + names[0] + " must be positive");
  for (const int i : {0, 1, 2, 4, 5, 6, 8, 9, 10}) {
    const bool must_vanish = i == 1 || i == 4 || i == 8 || i == 9;
    if (std::abs(left[i] - right[i]) > 1e-6 * left[0] || (must_vanish && left[i] != 0.0))
      throw std::runtime_error("file '" + path + "': " + names[0] + " and " + names[1] +
                               " do not belong to a rectified pair (equal pinhole cameras side by side)");
  }
  // The baseline is a difference: the offset of a colour pair's left camera is not zero.
  const StereoCamera camera{left[0], left[5], left[2], left[6], (left[3] - right[3]) / left[0], 0, 0};
  if (!(camera.baseline > 0.0))
    throw std::runtime_error(text(6, "file '", path, "': the baseline (difference of Tx / fx) is ", camera.baseline,
                                  " m but must be positive; ", names[0], " has fx = ", left[0], ", Tx = ", left[3],
                                  "; ", names[1], " has fx = ", right[0], ", Tx = ", right[3],
                                  " (are left and right swapped?)"));
  return camera;
}

/// Images of a folder by the number in their names, the longest one: 000042.png, 000042_left.png, rgb_00042.jpg.
std::map<std::int64_t, std::string> listNumbered(const std::string& folder) {
  std::map<std::int64_t, std::string> images;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    std::string number, digits;
    for (const char c : name + ".") {
      if (c >= '0' && c <= '9') digits += c;
      else if (digits.size() >= number.size()) number = std::exchange(digits, "");
      else digits.clear();
    }
    if (!isImageName(name) || number.empty() || number.size() > 18) continue;
    if (const auto [other, is_new] = images.emplace(std::stoll(number), name); !is_new)
      throw std::runtime_error("'" + folder + "' has '" + name + "' and '" + other->second + "' of the same number");
  }
  if (images.empty()) throw std::runtime_error("directory '" + folder + "' has no numbered images (PNG, JPEG)");
  return images;
}

/// "2011-09-30 11:50:40.123456789" as ns.
std::int64_t parseDate(const std::string& date, const std::string& time) {
  std::istringstream stream(date + " " + time);
  std::tm parts = {};
  std::string fraction;
  if (!(stream >> std::get_time(&parts, "%Y-%m-%d %H:%M:%S")))
    throw std::invalid_argument("'" + date + " " + time + "' is no time");
  stream >> fraction;
  return std::int64_t{::timegm(&parts)} * 1000000000 + (fraction.empty() ? 0 : parseSeconds("0" + fraction));
}

/// Of `count` images whose numbers begin with `first`: a line for each of them or, if `first` is not 0, for each number
/// from 0 on.
std::vector<std::int64_t> readStamps(const std::string& path, std::int64_t first, std::size_t count) {
  std::vector<std::int64_t> stamps;
  readLines(path, true, [&](const std::string& line) {
    const std::vector<std::string> words = splitWords(line);
    if (words.size() > 2) throw std::invalid_argument("expected one time in seconds, or a date and a time");
    const std::int64_t stamp = words.size() == 2 ? parseDate(words[0], words[1]) : parseSeconds(words[0]);
    if (!stamps.empty() && stamp <= stamps.back())
      throw std::invalid_argument("time " + line + " s is not later than the one before");
    stamps.push_back(stamp);
  });
  const auto before = static_cast<std::ptrdiff_t>(first);
  if (first > 0 && stamps.size() >= static_cast<std::size_t>(first) + count)
    return {stamps.begin() + before, stamps.begin() + before + static_cast<std::ptrdiff_t>(count)};
  if (stamps.size() > count)
    throw std::runtime_error(text(0, "file '", path, "' has more times than the ", count,
                                  " images: are images missing? An extract needs the times of its own images alone"));
  if (stamps.size() < count)
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

std::string kittiLayouts() {
  std::string all;
  for (const Layout& layout : kLayouts) {
    all += (all.empty() ? "" : "; ") + std::string(layout.name) + ": " + layout.images[0] + ", " + layout.images[1];
    if (layout.calibration) all += std::string(", ") + layout.calibration + ", " + layout.times;
  }
  return all;
}

bool isKittiLayout(const std::string& directory) {
  return std::any_of(std::begin(kLayouts), std::end(kLayouts),
                     [&](const Layout& layout) { return hasOneOf(directory, layout); });
}

StereoCamera readKittiCalibration(const std::string& path, KittiCameras cameras) {
  return cameraOf(path, layoutOf("", cameras == KittiCameras::kAny ? KittiCameras::kGrey : cameras).projections);
}

KittiSequence::KittiSequence(const std::string& directory, KittiCameras cameras, const Override& given)
    : directory_(directory) {
  if (!fs::is_directory(directory))
    throw std::runtime_error("sequence directory '" + directory + "' does not exist or is not a directory");
  const Layout& layout = layoutOf(directory, cameras);
  for (const std::size_t side : {0u, 1u})
    if (!fs::is_directory(fs::path(directory) / layout.images[side]))
      throw std::runtime_error("sequence directory '" + directory + "' has no " + layout.images[side]);
  listFrames({(fs::path(directory) / layout.images[0]).string(), (fs::path(directory) / layout.images[1]).string()});

  const cv::Mat image = readGreyImage(frames_[0][0]);
  camera_ = layout.camera;
  if (!given.calibration.empty()) {
    rectification_ = std::make_shared<const StereoRectification>(
        readCalibration(given.calibration, given.fov, image.size()));
    if (rectification_->raw(0).size != image.size())
      throw std::runtime_error("image '" + frames_[0][0] + "' does not have the resolution that its calibration says");
    camera_ = rectification_->camera();
  } else if (layout.calibration) {
    const std::string path = findCalibration(directory, layout.calibration);
    camera_ = cameraOf(path, layout.projections);
    const std::string size = std::string("S").append(layout.projections[0] + 1);  // S_rect_00 of KITTI raw
    if (const auto rectified = layout.projections[0][1] == '_' ? readNumbers(path, size, 2) : std::nullopt;
        rectified && cv::Size(cvRound((*rectified)[0]), cvRound((*rectified)[1])) != image.size())
      throw std::runtime_error(text(0, "image '", frames_[0][0], "' is ", image.cols, "x", image.rows, ", ", size,
                                    " of '", path, "' is ", (*rectified)[0], "x", (*rectified)[1],
                                    ": take the rectified images (drive_…_sync)"));
  } else if (image.size() != cv::Size(camera_.width, camera_.height)) {
    throw std::runtime_error(text(0, "image '", frames_[0][0], "' is ", image.cols, "x", image.rows, ", those of ",
                                  layout.name, " are ", camera_.width, "x", camera_.height,
                                  ": give the --calibration (layouts: docs/tools.md)"));
  }
  if (!rectification_) camera_.width = image.cols, camera_.height = image.rows;
  size_ = image.size();

  const fs::path times = fs::path(directory) / (layout.times ? layout.times : "times.txt");
  for (std::size_t i = 0; given.rate > 0.0 && i < frames_.size(); ++i)
    stamps_.push_back(std::llround(1e9 * static_cast<double>(i) / given.rate));
  if (given.rate > 0.0) return;
  if (!fs::exists(times))
    throw std::runtime_error("there is no file '" + times.string() + "' of times: give the pairs' rate, --rate HZ (layouts: docs/tools.md)");
  stamps_ = readStamps(times.string(), first_, frames_.size());
}

void KittiSequence::listFrames(const std::array<std::string, 2>& folders) {
  const std::array<std::map<std::int64_t, std::string>, 2> images{listNumbered(folders[0]), listNumbered(folders[1])};
  first_ = std::min(images[0].begin()->first, images[1].begin()->first);
  const std::int64_t last = std::max(images[0].rbegin()->first, images[1].rbegin()->first);
  for (std::int64_t number = first_; number <= last; ++number) {
    std::array<std::string, 2>& frame = frames_.emplace_back();
    for (const std::size_t side : {0u, 1u}) {
      const auto image = images[side].find(number);
      if (image == images[side].end())
        throw std::runtime_error(text(0, "image ", number, " is missing in '", folders[side], "' ('", folders[0],
                                      "' has ", images[0].size(), " images, '", folders[1], "' has ", images[1].size(),
                                      ", of numbers ", first_, " to ", last, ")"));
      frame[side] = (fs::path(folders[side]) / image->second).string();
    }
  }
}

ImagePair KittiSequence::load(int i) const {
  const auto& [left, right] = frames_.at(static_cast<std::size_t>(i));
  ImagePair pair{readGreyImage(left), readGreyImage(right)};
  if (pair.left.size() != pair.right.size())
    throw std::runtime_error(text(0, "images '", left, "' (", pair.left.cols, "x", pair.left.rows, ") and '", right,
                                  "' (", pair.right.cols, "x", pair.right.rows, ") differ in size"));
  if (pair.left.size() != size_)
    throw std::runtime_error(text(0, "image '", left, "' is ", pair.left.cols, "x", pair.left.rows,
                                  " but the first one of '", directory_, "' is ", size_.width, "x", size_.height));
  return pair;
}

ImagePair KittiSequence::loadRectified(int i) const {
  return rectification_ ? rectification_->rectify(load(i)) : load(i);
}

std::optional<std::string> findKittiPoses(const std::string& directory) {
  // The absolute path resolves "." and a trailing slash, either of which would hide the sequence's name.
  fs::path sequence = fs::absolute(directory).lexically_normal();
  if (sequence.filename().empty()) sequence = sequence.parent_path();
  const fs::path official =
      sequence.parent_path().parent_path() / "poses" / fs::path(sequence.filename().string() + ".txt");
  for (const fs::path& candidate : {sequence / "poses.txt", sequence / "pose_left.txt", official}) {
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
