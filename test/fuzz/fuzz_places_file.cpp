// A file of places of any content: it is refused with one std::runtime_error or std::invalid_argument, or a session can
// begin with it, and its map stays finite when it goes on and when it is optimised.
#include <rosbag/bag.h>
#include <std_msgs/Header.h>

#include "../../src/ros/files/places_file.hpp"
#include "../temporary_folder.hpp"
#include "fuzz_message.hpp"
#include "fuzz_places.hpp"

namespace {

using namespace sdvo;
namespace msgs = stereo_descriptor_vo;

void write(const std::string& path, FuzzBytes& bytes) {
  const SavedPlaces some = fuzz::somePlaces();
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  for (const Place& place : some.places) {
    msgs::Place message = ros_conversions::toMessage(place, "/robot", some.stream);
    fuzz::damage(message, bytes);
    bag.write("place", ros::Time(1), message);
  }
  if (bytes.flag()) bag.write(bytes.flag() ? "place" : "map_graph", ros::Time(1), std_msgs::Header());
  msgs::MapGraph graph = ros_conversions::toMessage({some.graph, {}}, "/robot", "map");
  fuzz::damage(graph, bytes);
  if (!bytes.flag()) bag.write("map_graph", ros::Time(2), graph);
  bag.close();
  // A file that was not written to its end.
  if (bytes.flag()) {
    const auto whole = static_cast<std::size_t>(std::filesystem::file_size(path));
    std::filesystem::resize_file(path, bytes.upTo(whole));
  }
}

void requireFinite(const PoseGraph& graph) {
  for (const auto& [id, T] : graph.nodes())
    if (!T.matrix().allFinite()) __builtin_trap();
}

void goOn(const SavedPlaces& saved) {
  static const Place next = fuzz::somePlaces().places[1];
  PlaceRecognitionOptions options;
  options.candidates = 1;  // looking at more takes most of the time
  PlaceRecognition recognition(options);
  recognition.restore(saved.places, saved.graph);
  for (int pair = 1; pair < 3; ++pair) {
    StereoFeatures features = next.features;
    features.stamp += pair * 10'000'000'000;
    CameraMotion motion;
    motion.T_odom_camera = Eigen::Translation3d(0.0, 0.0, 5.0 * pair) * next.T_odom_camera;
    motion.covariance = 1e-6 * Matrix6d::Identity();
    motion.continuous = pair > 1;
    recognition.observe(features, motion);
  }
  requireFinite(recognition.graph());
  PoseGraph graph = recognition.graph();
  graph.optimise();
  recognition.adopt(graph);
  requireFinite(recognition.graph());
  if (!recognition.T_map_odom().matrix().allFinite()) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzBytes bytes(data, size);
  static const TemporaryFolder folder;
  const std::string path = (std::filesystem::path(folder.path()) / "places.bag").string();
  write(path, bytes);
  try {
    goOn(loadPlaces(path));
  } catch (const std::runtime_error&) {
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
