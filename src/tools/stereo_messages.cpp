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
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <vector>

#include "../ros/camera_finder.hpp"

namespace sdvo {
namespace {

/// Empty for what is no camera's.
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
  image->encoding = encodingOf(pixels);
  image->height = static_cast<std::uint32_t>(pixels.rows);
  image->width = static_cast<std::uint32_t>(pixels.cols);
  image->step = static_cast<std::uint32_t>(pixels.cols * pixels.elemSize());
  image->data.assign(pixels.datastart, pixels.dataend);
  return image;
}

}  // namespace

void StereoNames::addTo(CLI::App& app, const std::string& scope) {
  app.add_option("--camera", camera, scope + "namespace of both sides")->capture_default_str();
  app.add_option("--left", left, scope + "name of the left side, such as infra1")->capture_default_str();
  app.add_option("--right", right, scope + "name of the right side")->capture_default_str();
  app.add_option("--image", image, scope + "name of the rectified images, such as image_rect_raw")
      ->capture_default_str();
}

StereoTopics StereoNames::topics() const {
  const std::string of_left = camera + "/" + left + "/", of_right = camera + "/" + right + "/";
  return {of_left + image, of_right + image, of_left + "camera_info", of_right + "camera_info"};
}

StereoTopics topicsIn(const rosbag::Bag& bag, const StereoNames& names) {
  StereoTopics topics = names.topics();
  ros::master::V_TopicInfo recorded;
  rosbag::View all(bag);
  for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
    const bool is_compressed = connection->datatype == "sensor_msgs/CompressedImage";
    recorded.emplace_back(connection->topic.substr(0, is_compressed ? connection->topic.rfind('/') : std::string::npos),
                          is_compressed ? "sensor_msgs/Image" : connection->datatype);
  }
  const bool is_there =
      std::any_of(recorded.begin(), recorded.end(), [&](const auto& t) { return t.name == topics[0]; });
  StereoNames usual;
  const std::string folder = names.camera == usual.camera ? "/" : names.camera + "/";
  usual.camera = names.camera;
  const std::vector<ros::M_string> cameras = findStereoCameras(folder, recorded);
  if (!is_there && topics == usual.topics() && cameras.size() == 1)
    topics = {cameras[0].at("left/image_rect"), cameras[0].at("right/image_rect"), cameras[0].at("left/camera_info"),
              cameras[0].at("right/camera_info")};
  const auto has = [&bag](const std::string& topic) { return rosbag::View(bag, rosbag::TopicQuery(topic)).size() > 0; };
  for (const std::size_t image : {0u, 1u})
    if (!has(topics[image]) && has(topics[image] + "/compressed")) topics[image] += "/compressed";
  return topics;
}

void refuseWhatIsWritten(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  // Linux grants this lease only where nobody has the file open to write; asking for it is all. EAGAIN: somebody has.
  const bool is_written = file >= 0 && ::fcntl(file, F_SETLEASE, F_RDLCK) != 0 && errno == EAGAIN;
  if (file >= 0) ::close(file);
  if (is_written)
    throw std::runtime_error("'" + path + "' is being written: end its recorder (Ctrl-C), which completes it");
}

void openBag(const std::string& path, rosbag::Bag& bag) {
  if (!std::filesystem::is_regular_file(path)) throw std::runtime_error("'" + path + "' is no file");
  ofBag(path, [&] { bag.open(path, rosbag::bagmode::Read); });
}

StereoMessage readStereoMessage(const rosbag::MessageInstance& instance, const StereoTopics& topics) {
  const auto input =
      static_cast<std::size_t>(std::find(topics.begin(), topics.end(), instance.getTopic()) - topics.begin());
  StereoMessage message{input, nullptr, nullptr};
  if (input >= 2)
    message.info = instance.instantiate<sensor_msgs::CameraInfo>();
  else if (const auto compressed = instance.instantiate<sensor_msgs::CompressedImage>())
    message.image = decode(*compressed);
  else
    message.image = instance.instantiate<sensor_msgs::Image>();
  if (!message.image && !message.info)
    throw std::runtime_error(instance.getTopic() + " holds " + instance.getDataType() + ", expected " +
                             (input < 2 ? "sensor_msgs/Image or CompressedImage" : "sensor_msgs/CameraInfo"));
  return message;
}

}  // namespace sdvo
