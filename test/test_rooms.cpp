#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kSource = SDVO_SOURCE_DIR;

/// What each room may include of the others. The image side and the motion side meet in common/stereo_features alone.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"common", {}},
    {"front_end", {"common"}},
    {"motion", {"common"}},
    {"matching", {"common", "motion"}},
    {"map", {"common", "motion", "matching"}},
    {"belief", {"common", "motion", "matching", "map"}},
    {"rig", {"common", "motion", "matching", "map", "belief"}},
    {"odometry", {"common", "motion", "matching", "map", "belief", "rig"}},
    {"places", {"common", "motion", "matching", "map", "belief", "rig", "odometry"}},
    {"data", {"common"}},
    {"config", {"common", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places"}},
    {"check", {"common", "front_end", "motion", "matching", "map", "belief", "rig", "odometry"}},
    {"messages", {"common", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places"}},
    {"ros",
     {"common", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places", "config", "check",
      "messages"}},
    {"tools",
     {"common", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places", "data", "config",
      "check", "messages", "ros"}},
};

/// Rooms that a program without ROS can use.
const std::set<std::string> kWithoutRos = {"common", "front_end", "motion", "matching", "map",    "belief",
                                           "rig",    "odometry",  "places", "data",     "config", "check"};

struct Include {
  fs::path file;
  int line;
  std::string header;  ///< as written
};

/// The header that a line includes, empty if none.
std::string headerOf(const std::string& line) {
  static const std::regex include(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::smatch match;
  return std::regex_search(line, match, include) ? match[1].str() : "";
}

/// Whether a header is ROS's or made by its build. Debian installs ROS headers in /usr/include, so the compiler would
/// find them without being told where to look.
bool isRos(const std::string& header) {
  static const std::regex ros(
      R"(^(\.\./)*(ros|tf|nodelet|nodelet_topic_tools|cv_bridge|rosbag|rosbag_storage|message_filters|image_transport|pluginlib|)"
      R"(class_loader|image_geometry|dynamic_reconfigure|diagnostic_updater|actionlib|bondcpp|xmlrpcpp|rosconsole|)"
      R"(catkin|topic_tools|angles|eigen_conversions)/.*|^tf2.*/.*|^[A-Za-z0-9_]+_msgs/.*|^std_srvs/.*|)"
      R"(^stereo_descriptor_vo/[A-Z].*|^stereo_descriptor_vo/ros/.*)");
  return std::regex_match(header, ros);
}

/// The room that a header belongs to as included from a file in `room`: that room itself for plain names, empty for
/// headers from elsewhere.
std::string roomOf(const std::string& header, const std::string& room) {
  static const std::regex ours(R"(^(?:\.\./|stereo_descriptor_vo/)([a-z_]+)/[a-z_/]+\.(?:hpp|inc)$)");
  std::smatch match;
  if (std::regex_match(header, match, ours)) return match[1];
  return header.find('/') == std::string::npos && fs::exists(kSource / "src" / room / header) ? room : "";
}

std::vector<Include> includesOf(const std::string& room) {
  std::vector<Include> includes;
  for (const fs::path& directory : {kSource / "include" / "stereo_descriptor_vo" / room, kSource / "src" / room}) {
    if (!fs::exists(directory)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(directory)) {
      std::ifstream stream(entry.path());
      std::string line;
      for (int number = 1; std::getline(stream, line); ++number)
        if (const std::string header = headerOf(line); !header.empty())
          includes.push_back({entry.path(), number, header});
    }
  }
  return includes;
}

TEST(Rooms, EveryFolderOfTheSourcesIsOne) {
  for (const fs::path& parent : {kSource / "include" / "stereo_descriptor_vo", kSource / "src"})
    for (const fs::directory_entry& entry : fs::directory_iterator(parent)) {
      EXPECT_TRUE(entry.is_directory()) << entry.path() << " lies outside of every room";
      EXPECT_EQ(kMayInclude.count(entry.path().filename().string()), 1u) << entry.path() << " is no known room";
    }
}

TEST(Rooms, EachIncludesOnlyWhatItMay) {
  for (const auto& [room, others] : kMayInclude) {
    const std::vector<Include> includes = includesOf(room);
    EXPECT_FALSE(includes.empty()) << room;
    for (const Include& include : includes) {
      const std::string other = roomOf(include.header, room);
      if (other.empty() || other == room) continue;
      EXPECT_EQ(others.count(other), 1u) << include.file.string() << ":" << include.line << " includes "
                                         << include.header;
    }
  }
}

/// The lab measures the product; the product builds and runs without it.
TEST(Rooms, TheProductIncludesNothingOfTheLab) {
  for (const auto& [room, others] : kMayInclude)
    for (const Include& include : includesOf(room))
      EXPECT_EQ(include.header.find("lab/"), std::string::npos)
          << include.file.string() << ":" << include.line << " includes " << include.header;
  for (const std::string room : {"render", "experiments"}) {
    EXPECT_TRUE(fs::exists(kSource / "lab" / room)) << room;
    EXPECT_EQ(kMayInclude.count(room), 0u) << room;
  }
}

TEST(Rooms, TheCoreAndItsToolboxKnowNoRos) {
  for (const std::string& room : kWithoutRos)
    for (const Include& include : includesOf(room))
      EXPECT_FALSE(isRos(include.header))
          << include.file.string() << ":" << include.line << " includes " << include.header;
}

/// OpenCV's readers of image files, which cv_bridge brings as well, bring a hundred libraries into a robot's processes.
TEST(Rooms, WhatRunsOnARobotReadsNoImageFilesWithOpenCv) {
  for (const std::string room :
       {"common", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places", "config", "ros"})
    for (const Include& include : includesOf(room))
      EXPECT_TRUE(include.header != "opencv2/imgcodecs.hpp" && include.header != "opencv2/highgui.hpp" &&
                  include.header != "opencv2/opencv.hpp" && include.header.rfind("cv_bridge/", 0) != 0)
          << include.file.string() << ":" << include.line << " includes " << include.header;
}

/// With one sentence, before anything that only C++17 has. Headers that include another one of ours leave it to that
/// one.
TEST(Rooms, EveryPublicHeaderRefusesOlderStandards) {
  const fs::path include = kSource / "include";
  std::set<std::string> public_headers, guarded;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(include))
    if (entry.path().extension() == ".hpp") public_headers.insert(entry.path().lexically_relative(include).string());
  for (const std::string& header : public_headers) {
    std::ifstream stream(include / header);
    std::string line;
    while (std::getline(stream, line))
      if (public_headers.count(headerOf(line)) > 0) guarded.insert(header);
  }
  guarded.insert("stereo_descriptor_vo/common/cpp17.hpp");
  EXPECT_EQ(guarded, public_headers);

  const std::string command = "c++ -std=c++14 -fsyntax-only -x c++ -I '" + include.string() +
                              "' -include stereo_descriptor_vo/common/options.hpp /dev/null 2>&1";
  FILE* compiler = ::popen(command.c_str(), "r");
  ASSERT_NE(compiler, nullptr);
  std::string said;
  for (int c = 0; (c = std::fgetc(compiler)) != EOF;) said += static_cast<char>(c);
  EXPECT_NE(::pclose(compiler), 0);
  EXPECT_NE(said.find("error: #error stereo_descriptor_vo needs C++17"), std::string::npos) << said;
  EXPECT_LT(std::count(said.begin(), said.end(), '\n'), 12) << said;
}

TEST(Rooms, TheSearchKnowsRosHeaders) {
  for (const char* line :
       {"#include <ros/ros.h>", "#include \"../messages/pose_conversions.hpp\"", "  #  include <ros/time.h>",
        "#include <sensor_msgs/Image.h>", "#include <nav_msgs/Odometry.h>", "#include <tf2/utils.h>",
        "#include <tf2_ros/buffer.h>", "#include <nodelet/nodelet.h>", "#include <cv_bridge/cv_bridge.h>",
        "#include <message_filters/subscriber.h>", "#include <image_transport/image_transport.h>",
        "#include <rosbag/bag.h>", "#include <pluginlib/class_list_macros.hpp>",
        "#include \"stereo_descriptor_vo/StereoFeatures.h\"",
        "#include <stereo_descriptor_vo/ros/stereo_features_view.hpp>"})
    EXPECT_TRUE(isRos(headerOf(line))) << line;
  for (const char* line : {"#include <cstdint>", "#include <opencv2/core.hpp>", "#include <Eigen/Geometry>",
                           "#include \"stereo_descriptor_vo/common/stereo_features.hpp\"",
                           "#include \"freak_pairs.inc\"", "// #include <ros/ros.h> would not do"})
    EXPECT_FALSE(isRos(headerOf(line))) << line;
}

TEST(Rooms, TheSearchKnowsTheRoomOfAHeader) {
  EXPECT_EQ(roomOf("stereo_descriptor_vo/map/local_map.hpp", "front_end"), "map");
  EXPECT_EQ(roomOf("../data/text_file.hpp", "tools"), "data");
  EXPECT_EQ(roomOf("log_sum.hpp", "motion"), "motion");
  EXPECT_EQ(roomOf("opencv2/core.hpp", "odometry"), "");
  EXPECT_EQ(roomOf("vector", "odometry"), "");
}

}  // namespace
