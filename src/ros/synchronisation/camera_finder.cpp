#include "camera_finder.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace sdvo {

const std::vector<std::string> kRectifiedImages = {"image_rect", "image_rect_raw", "image_rect_gray",
                                                   "image_rect_color"};

namespace {

const std::vector<std::pair<std::string, std::string>> kSides = {
    {"left", "right"}, {"infra1", "infra2"}, {"cam0", "cam1"}, {"fisheye1", "fisheye2"}};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != text.npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

/// " " and the left image of each camera.
std::string leftImages(const std::vector<ros::M_string>& cameras) {
  std::string names;
  for (const ros::M_string& camera : cameras) names += " " + camera.at("left/image_rect");
  return names;
}

}  // namespace

bool isAmong(const ros::master::V_TopicInfo& topics, const std::string& name) {
  return std::any_of(topics.begin(), topics.end(), [&](const auto& topic) { return topic.name == name; });
}

std::string explainUnpublished(const std::vector<std::string>& names, const ros::master::V_TopicInfo& topics) {
  std::string text;
  for (const std::string& name : names) {
    if (isAmong(topics, name)) continue;
    text += "; nobody publishes " + name;
    if (isAmong(topics, name + "/compressed"))
      text +=
          ", but its /compressed: set stereo_features/image_transport to compressed, for one side alone "
          "stereo_features/left_image/image_transport or right_image/image_transport";
  }
  return text.empty() ? text : text + listStereoCameras(topics);
}

std::string listStereoCameras(const ros::master::V_TopicInfo& topics) {
  if (const auto cameras = findStereoCameras("/", topics); !cameras.empty())
    return "; stereo cameras are on:" + leftImages(cameras);
  const auto raw = findStereoCameras("/", topics, {"image_raw"});
  return raw.empty() ? "" : "; raw stereo cameras, for stereo_raw.launch, are on:" + leftImages(raw);
}

std::vector<ros::M_string> findStereoCameras(const std::string& ns, const ros::master::V_TopicInfo& topics,
                                             const std::vector<std::string>& images) {
  std::map<std::string, ros::M_string> cameras;  // by the folder of the left one
  for (const std::string& image : images)
    for (const ros::master::TopicInfo& topic : topics)
      for (const auto& [left, right] : kSides) {
        const std::size_t folder = topic.name.rfind('/') + 1;
        if (topic.name.compare(0, ns.size(), ns) != 0 || folder < ns.size() || topic.name.substr(folder) != image)
          continue;
        const std::string here = topic.name.substr(0, folder);
        const std::string there = ns + replaced(here.substr(ns.size()), left, right);
        const bool is_whole = isAmong(topics, there + image) && isAmong(topics, here + "camera_info") &&
                              isAmong(topics, there + "camera_info");
        if (here != there && is_whole)
          cameras.try_emplace(here, ros::M_string{{"left/image_rect", here + image},
                                                  {"right/image_rect", there + image},
                                                  {"left/camera_info", here + "camera_info"},
                                                  {"right/camera_info", there + "camera_info"}});
      }
  std::vector<ros::M_string> found;
  for (auto& [folder, names] : cameras) found.push_back(std::move(names));
  return found;
}

CameraFinder::CameraFinder(const std::string& ns, std::string left, std::string right)
    : ns_(ns == "/" ? "/" : ns + "/"), left_(std::move(left)), right_(std::move(right)) {}

bool CameraFinder::update(const ros::master::V_TopicInfo& topics, std::string& report) {
  if (left_ != ns_ + "left/image_rect" || right_ != ns_ + "right/image_rect") return false;
  const auto own = std::find_if(topics.begin(), topics.end(), [this](const auto& topic) {
    const std::string name = topic.name + "/";  // of any transport
    return name.find(left_ + "/") == 0 || name.find(right_ + "/") == 0;
  });
  if (own != topics.end()) {
    if (names_.empty()) return false;
    report = "somebody publishes " + own->name + ": images are taken from " + left_ + " and " + right_ +
             " again, no more from " + names_.at("left/image_rect");
    names_.clear();
    return true;
  }
  if (!names_.empty()) return false;
  const std::vector<ros::M_string> cameras = findStereoCameras(ns_, topics);
  if (cameras.empty()) return false;
  report = "nobody publishes " + left_ + " and " + right_;
  if (cameras.size() > 1) {
    report += ", and there are several stereo cameras in " + ns_ +
              ": set left_image_topic and the like to those of one:" + leftImages(cameras);
    return false;
  }
  names_ = cameras.front();
  has_chosen_ = true;
  report += ": the only stereo camera in " + ns_ + " is taken, with " + names_.at("left/image_rect") + " and " +
            names_.at("right/image_rect") + "; parameter find_camera false for none";
  return true;
}

ros::NodeHandle CameraFinder::handle(const ros::NodeHandle& nh) const {
  if (names_.empty()) return nh;
  ros::NodeHandle renamed(nh.getNamespace(), names_);  // not of `nh`, whose remappings would win
  renamed.setCallbackQueue(nh.getCallbackQueue());
  return renamed;
}

}  // namespace sdvo
