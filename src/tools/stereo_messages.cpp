#include "stereo_messages.hpp"

#include <fcntl.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/image_encodings.h>
#include <unistd.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "../common/text.hpp"
#include "../data/file_kind.hpp"
#include "../messages/image_conversions.hpp"
#include "../ros/synchronisation/camera_finder.hpp"

namespace sdvo {
namespace {

/// Empty for a type of pixels that no camera has.
std::string encodingOf(const cv::Mat& pixels) {
  namespace encodings = sensor_msgs::image_encodings;
  switch (pixels.type()) {
    case CV_8UC1:
      return encodings::MONO8;
    case CV_16UC1:
      return encodings::MONO16;
    case CV_8UC3:
      return encodings::BGR8;
    case CV_8UC4:
      return encodings::BGRA8;
    default:
      return "";
  }
}

sensor_msgs::ImageConstPtr decode(const sensor_msgs::CompressedImage& compressed) {
  const cv::Mat pixels = compressed.data.empty() ? cv::Mat() : cv::imdecode(compressed.data, cv::IMREAD_UNCHANGED);
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header = compressed.header;
  image->encoding = pixels.empty() ? ros_conversions::kUndecoded + compressed.format : encodingOf(pixels);
  image->height = static_cast<std::uint32_t>(pixels.rows);
  image->width = static_cast<std::uint32_t>(pixels.cols);
  image->step = static_cast<std::uint32_t>(pixels.cols * pixels.elemSize());
  image->data.assign(pixels.datastart, pixels.dataend);
  return image;
}

/// Types of a definition's fields in their order, without names. Nested messages are replaced by their fields.
std::string layoutOf(const std::string& definition, const std::string& type = "", int depth = 0) {
  constexpr int kDeepest = 10;
  std::istringstream lines(definition);
  std::string layout;
  bool is_here = type.empty();
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string field, name;
    if (!(words >> field >> name)) continue;
    if (field == "MSG:") {
      if (is_here) break;
      name = ros1Type(name);
      is_here = name == type || (type.find('/') == std::string::npos && name.substr(name.rfind('/') + 1) == type);
      continue;
    }
    if (!is_here || line.find('=') != std::string::npos) continue;  // a constant, or the line above the next message
    const std::size_t array = std::min(field.find('['), field.size());
    const std::string base = ros1Type(field.substr(0, array));
    const std::string nested = depth < kDeepest ? layoutOf(definition, base, depth + 1) : "";
    layout += (nested.empty() ? base : "(" + nested + ")") + field.substr(array) + " ";
  }
  return layout;
}

/// Where a bag has its index, by its first record; 0: nowhere, or no bag.
std::uint64_t placeOfIndex(const std::string& path) {
  std::string begin(256, '\0');
  std::ifstream(path, std::ios::binary).read(begin.data(), static_cast<std::streamsize>(begin.size()));
  const std::string name = "index_pos=";
  const std::size_t at = begin.find(name);
  std::uint64_t place = 0;  // as bags have it: little-endian
  if (begin.rfind("#ROSBAG V2", 0) == 0 && at < begin.size() - name.size() - sizeof place)
    for (std::size_t i = 0; i < sizeof place; ++i)
      place |= std::uint64_t{static_cast<unsigned char>(begin[at + name.size() + i])} << (8 * i);
  return place;
}

/// Of the topics of a type, compressed or not.
std::string namesOf(const ros::master::V_TopicInfo& topics, const std::string& type) {
  std::set<std::string> names;
  for (const ros::master::TopicInfo& topic : topics)
    if (const std::string found = topic.datatype.substr(topic.datatype.rfind('/') + 1);
        found == type || found == "Compressed" + type)
      names.insert(topic.name);
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  return all.empty() ? "none" : all;
}

/// Usual names of raw images.
const std::vector<std::string> kRawImages = {"image_raw", "image_mono", "image", "image_color"};

}  // namespace

void StereoSource::addTo(CLI::App& app) {
  app.add_option("--camera", camera, "topics: namespace of both sides")->capture_default_str();
  app.add_option("--left", left, "topics: name of the left side, such as infra1")->capture_default_str();
  app.add_option("--right", right, "topics: name of the right side")->capture_default_str();
  app.add_option("--image", image,
                 "topics: name of the images, such as image_rect_raw; without 'rect' in it they are raw, and rectified")
      ->capture_default_str();
  app.add_option("--images", images, "topics: images of left and right, in place of the four names above")->expected(2);
  app.add_option("--infos", infos, "topics: camera_info of left and right, where they are not beside the images")
      ->expected(2);
  app.add_option("--calibration", calibration,
                 "file in place of camera_info or sensor.yaml, or two, left and right: of Kalibr, camera_calibration, "
                 "OpenCV, ORB-SLAM, VINS or EuRoC")
      ->expected(1, 3)
      ->check(CLI::ExistingFile);
  app.add_option("--fov", fov, "raw images: field of view once rectified, from side to side, deg; 0: as calibrated")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 170.0));
  app.add_option("--rate", rate, "folders without a file of times: rate of the pairs, Hz")
      ->check(CLI::Range(0.001, 10000.0));
}

std::string StereoSource::folder() const {
  return camera.substr(0, camera.find_last_not_of('/') + 1) + "/";
}

StereoTopics StereoSource::topics() const {
  StereoTopics topics{folder() + left + "/" + image, folder() + right + "/" + image, "", ""};
  if (!images.empty()) topics = {images.front(), images.back(), "", ""};
  const std::vector<std::string>& named = calibration.empty() ? infos : calibration;
  for (const std::size_t side : {0u, 1u})
    topics[side + 2] = !named.empty() ? (side == 0 ? named.front() : named.back())
                                      : topics[side].substr(0, topics[side].rfind('/') + 1) + "camera_info";
  return topics;
}

StereoTopics topicsIn(const rosbag::Bag& bag, const StereoSource& source) {
  StereoTopics topics = source.topics();
  ros::master::V_TopicInfo recorded, imagined;  // names without /compressed; images, each with a camera_info added
  rosbag::View all(bag);
  for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
    const std::string& type = connection->datatype;
    const bool is_compressed = type.find("/CompressedImage") != std::string::npos;
    const std::string name =
        connection->topic.substr(0, is_compressed ? connection->topic.rfind('/') : std::string::npos);
    recorded.emplace_back(name, type);
    if (!is_compressed && type.find("/Image") == std::string::npos) continue;
    imagined.emplace_back(name, type);
    imagined.emplace_back(name.substr(0, name.rfind('/') + 1) + "camera_info", "");
  }
  StereoSource usual;
  usual.camera = source.camera;
  usual.calibration = source.calibration;
  if (topics == usual.topics() && !isAmong(recorded, topics[0])) {
    const std::string folder = source.camera == StereoSource().camera ? "/" : source.folder();
    for (const ros::master::V_TopicInfo* among : {&recorded, &imagined})
      for (const auto& images : {kRectifiedImages, kRawImages}) {
        const std::vector<ros::M_string> cameras = findStereoCameras(folder, *among, images);
        if (isAmong(recorded, topics[0]) || cameras.size() != 1) continue;
        topics[0] = cameras[0].at("left/image_rect");
        topics[1] = cameras[0].at("right/image_rect");
        if (!source.calibration.empty()) continue;
        topics[2] = cameras[0].at("left/camera_info");
        topics[3] = cameras[0].at("right/camera_info");
      }
  }
  const std::string path = bag.getFileName();
  for (const std::size_t input : {0u, 1u}) {
    if (isAmong(imagined, topics[input])) continue;
    throw std::runtime_error("'" + path + "' has no " + topics[input] + "; its images: " + namesOf(recorded, "Image") +
                             ": name the left and the right one by --images, their camera_info (" +
                             namesOf(recorded, "CameraInfo") + ") by --infos");
  }
  for (const std::size_t input : {2u, 3u})  // as stereo_raw.launch records it where it is given a field of view
    if (const std::string of_fov = topics[input].substr(0, topics[input].rfind('/') + 1) + "rectifiable/camera_info";
        !isAmong(recorded, topics[input]) && isAmong(recorded, of_fov))
      topics[input] = of_fov;
  for (const std::size_t input : {2u, 3u})
    if (source.calibration.empty() && !isAmong(recorded, topics[input]))
      throw std::runtime_error("'" + path + "' has images on " + topics[0] + " and " + topics[1] + ", but no " +
                               topics[input] + " (camera_info: " + namesOf(recorded, "CameraInfo") +
                               "): name those of left and right by --infos, or give --calibration camchain.yaml "
                               "(Kalibr's), or --calibration left.yaml right.yaml (docs/tools.md)");
  for (const std::size_t input : {0u, 1u})
    if (rosbag::View(bag, rosbag::TopicQuery(topics[input])).size() == 0) topics[input] += "/compressed";
  return topics;
}

void refuseWhatIsWritten(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  // Linux refuses this lease (EAGAIN) while somebody has the file open for writing. close() ends it.
  const bool is_written = file >= 0 && ::fcntl(file, F_SETLEASE, F_RDLCK) != 0 && errno == EAGAIN;
  if (file >= 0) ::close(file);
  if (is_written)
    throw std::runtime_error("'" + path + "' is being written: end its recorder (Ctrl-C), which completes it");
}

void openBag(const std::string& path, rosbag::Bag& bag) {
  if (!std::filesystem::is_regular_file(path)) throw std::runtime_error("'" + path + "' is no file");
  if (const std::string other = otherKindOf(path); !other.empty())
    throw std::runtime_error("'" + path + "' is " + other + ". Bags of ROS 1 are read");
  if (const std::uint64_t begun = placeOfIndex(path); begun > std::filesystem::file_size(path))
    throw std::runtime_error(text(0, "'", path, "' is a part of a bag, ", std::filesystem::file_size(path),
                                  " bytes of more than ", begun, ": copy it again"));
  ofBag(path, [&] { bag.open(path, rosbag::bagmode::Read); });
}

std::string ros1Type(std::string type) {
  if (const std::size_t ros2 = type.find("/msg/"); ros2 != std::string::npos) type.erase(ros2, 4);
  return type;
}

void requireLayout(const rosbag::MessageInstance& instance, const std::string& type, const std::string& definition,
                   const std::string& md5) {
  const std::string here = layoutOf(definition), there = layoutOf(instance.getMessageDefinition());
  if (here != there)
    throw std::runtime_error(instance.getTopic() + " holds " + type + " of another definition: " + there + "(MD5 " +
                             instance.getMD5Sum() + "), expected " + here + "(MD5 " + md5 + ")");
}

StereoMessage readStereoMessage(const rosbag::MessageInstance& instance, const StereoTopics& topics) {
  const auto input =
      static_cast<std::size_t>(std::find(topics.begin(), topics.end(), instance.getTopic()) - topics.begin());
  const ros::Time& recorded = instance.getTime();
  if (input >= 2) {
    if (const auto info = readAs<sensor_msgs::CameraInfo>(instance)) return toStereoMessage(input, recorded, info);
  } else if (const auto image = readAs<sensor_msgs::Image>(instance)) {
    return toStereoMessage(input, recorded, image);
  } else if (const auto compressed = readAs<sensor_msgs::CompressedImage>(instance)) {
    return toStereoMessage(input, recorded, decode(*compressed));
  }
  throw std::runtime_error(instance.getTopic() + " holds " + instance.getDataType() + ", expected " +
                           (input < 2 ? "sensor_msgs/Image or CompressedImage" : "sensor_msgs/CameraInfo"));
}

}  // namespace sdvo
