#include "camera_finder.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace sdvo {
namespace {

/// As drivers and image_proc call rectified images, what is best for features first.
const std::vector<std::string> kImages = {"image_rect", "image_rect_raw", "image_rect_gray", "image_rect_color"};
const std::vector<std::pair<std::string, std::string>> kSides = {
    {"left", "right"}, {"infra1", "infra2"}, {"cam0", "cam1"}};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != text.npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

bool isAmong(const ros::master::V_TopicInfo& topics, const std::string& name) {
  return std::any_of(topics.begin(), topics.end(), [&](const auto& topic) { return topic.name == name; });
}

}  // namespace

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
  return text;
}

std::vector<ros::M_string> findStereoCameras(const std::string& ns, const ros::master::V_TopicInfo& topics) {
  std::map<std::string, ros::M_string> cameras;  // by the folder of the left one
  for (const std::string& image : kImages)
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

std::optional<ros::NodeHandle> findOnlyStereoCamera(const ros::NodeHandle& nh, std::string& problem) {
  const std::string ns = nh.getNamespace() == "/" ? "/" : nh.getNamespace() + "/";
  ros::master::V_TopicInfo topics;
  if (!ros::master::getTopics(topics)) return std::nullopt;
  for (const char* name : {"left/image_rect", "right/image_rect"}) {
    const bool is_ours = std::any_of(topics.begin(), topics.end(),
                                     [&](const auto& t) { return (t.name + "/").find(ns + name + "/") == 0; });
    if (is_ours || nh.resolveName(name) != ns + name) return std::nullopt;
  }
  const std::vector<ros::M_string> cameras = findStereoCameras(ns, topics);
  if (cameras.size() == 1) {
    ros::NodeHandle found(nh.getNamespace(), cameras.front());  // not of `nh`, whose remappings would win
    found.setCallbackQueue(nh.getCallbackQueue());
    return found;
  }
  for (const ros::M_string& camera : cameras)
    problem += (problem.empty() ? "several stereo cameras: " : ", ") + camera.at("left/image_rect");
  return std::nullopt;
}

}  // namespace sdvo
