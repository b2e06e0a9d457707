#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
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
    {"options", {"common"}},
    {"front_end", {"common", "options"}},
    {"motion", {"common", "options"}},
    {"matching", {"common", "options", "motion"}},
    {"map", {"common", "options", "motion", "matching"}},
    {"belief", {"common", "options", "motion", "matching", "map"}},
    {"rig", {"common", "options", "motion", "matching", "map", "belief"}},
    {"odometry", {"common", "options", "motion", "matching", "map", "belief", "rig"}},
    {"places", {"common", "options", "motion", "matching", "map", "belief", "rig", "odometry"}},
    {"data", {"common", "options"}},
    {"config", {"common", "options", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places"}},
    {"check", {"common", "options", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "config"}},
    {"messages",
     {"common", "options", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places"}},
    {"ros",
     {"common", "options", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places", "config",
      "check", "messages"}},
    {"tools",
     {"common", "options", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places", "data",
      "config", "check", "messages", "ros"}},
};

/// Rooms that a program without ROS can use.
const std::set<std::string> kWithoutRos = {"common", "options",  "front_end", "motion", "matching", "map",  "belief",
                                           "rig",    "odometry", "places",    "data",   "config",   "check"};

struct Include {
  fs::path file;
  int line;
  std::string header;  ///< by fromItsRoom()
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
      R"(^stereo_descriptor_vo/[A-Z].*|^stereo_descriptor_vo/messages/.*|^\.\./messages/.*)");
  return std::regex_match(header, ros);
}

/// The room that a header belongs to, empty for headers from elsewhere.
std::string roomOf(const std::string& header) {
  static const std::regex ours(R"(^(?:\.\./|stereo_descriptor_vo/)([a-z_]+)/[a-z_/]+\.(?:hpp|inc)$)");
  std::smatch match;
  return std::regex_match(header, match, ours) ? match[1].str() : "";
}

/// All files below a folder; none where it does not exist.
std::vector<fs::path> filesBelow(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::exists(folder)) return files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  return files;
}

std::vector<fs::path> filesOf(const std::string& room) {
  std::vector<fs::path> files = filesBelow(kSource / "src" / room);
  for (const fs::path& file : filesBelow(kSource / "include" / "stereo_descriptor_vo" / room)) files.push_back(file);
  return files;
}

/// A header that a file includes; one of our sources as a file that lies in a room itself, not in a folder of it,
/// would.
std::string fromItsRoom(const fs::path& file, const std::string& header) {
  const fs::path source = (file.parent_path() / header).lexically_normal().lexically_relative(kSource / "src");
  return *source.begin() != ".." && fs::exists(kSource / "src" / source) ? "../" + source.string() : header;
}

std::vector<Include> includesIn(const fs::path& file) {
  std::vector<Include> includes;
  std::ifstream stream(file);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number)
    if (const std::string header = headerOf(line); !header.empty())
      includes.push_back({file, number, fromItsRoom(file, header)});
  return includes;
}

std::vector<Include> includesOf(const std::string& room) {
  std::vector<Include> includes;
  for (const fs::path& file : filesOf(room))
    for (const Include& include : includesIn(file)) includes.push_back(include);
  return includes;
}

TEST(Rooms, EveryFolderOfTheSourcesIsOne) {
  for (const fs::path& parent : {kSource / "include" / "stereo_descriptor_vo", kSource / "src"})
    for (const fs::directory_entry& entry : fs::directory_iterator(parent)) {
      EXPECT_TRUE(entry.is_directory()) << entry.path() << " lies outside of every room";
      EXPECT_EQ(kMayInclude.count(entry.path().filename().string()), 1u) << entry.path() << " is no known room";
    }
}

/// The arrows among a room's includes that lead where it may not.
std::vector<std::string> againstTheFlow(const std::string& room, const std::vector<Include>& includes) {
  std::vector<std::string> wrong;
  for (const Include& include : includes) {
    const std::string other = roomOf(include.header);
    if (other.empty() || other == room || kMayInclude.at(room).count(other) > 0) continue;
    wrong.push_back(include.file.string() + ":" + std::to_string(include.line) + " includes " + include.header);
  }
  return wrong;
}

TEST(Rooms, EachIncludesOnlyWhatItMay) {
  for (const auto& [room, others] : kMayInclude) {
    const std::vector<Include> includes = includesOf(room);
    EXPECT_FALSE(includes.empty()) << room;
    EXPECT_EQ(againstTheFlow(room, includes), std::vector<std::string>{}) << room;
  }
}

TEST(Rooms, AnArrowAgainstTheFlowIsFound) {
  const std::map<std::string, std::string> planted = {
      {"front_end", "stereo_descriptor_vo/matching/feature_matcher.hpp"},
      {"matching", "../src/front_end/freak.hpp"},
      {"rig", "stereo_descriptor_vo/odometry/odometry_result.hpp"},
      {"common", "stereo_descriptor_vo/motion/noise.hpp"},
      {"check", "../tools/recording.hpp"}};
  for (const auto& [room, header] : planted) {
    std::vector<Include> includes = includesOf(room);
    includes.push_back({"planted.cpp", 7, header});
    EXPECT_EQ(againstTheFlow(room, includes), std::vector<std::string>{"planted.cpp:7 includes " + header}) << room;
  }
}

/// Each file of a room and those of the room that it includes, by name.
using Includes = std::map<std::string, std::set<std::string>>;

Includes includesInside(const std::string& room) {
  Includes inside;
  for (const Include& include : includesOf(room))
    if (roomOf(include.header) == room)
      inside[include.file.filename().string()].insert(fs::path(include.header).filename().string());
  return inside;
}

/// How many files the longest chain of includes from a file on has; none where it leads back to itself.
std::optional<int> floorsOf(const std::string& file, const Includes& inside, std::set<std::string> above = {}) {
  if (!above.insert(file).second) return std::nullopt;
  int below = 0;
  if (inside.count(file) > 0)
    for (const std::string& other : inside.at(file)) {
      const std::optional<int> floors = floorsOf(other, inside, above);
      if (!floors) return std::nullopt;
      below = std::max(below, *floors);
    }
  return 1 + below;
}

TEST(Rooms, NoneHasMoreThanSixFloors) {
  constexpr int kMost = 6;
  for (const auto& [room, others] : kMayInclude) {
    const Includes inside = includesInside(room);
    for (const auto& [file, included] : inside) {
      const std::optional<int> floors = floorsOf(file, inside);
      ASSERT_TRUE(floors) << room << "/" << file << " includes itself by others";
      EXPECT_LE(*floors, kMost) << room << "/" << file;
    }
  }
}

TEST(Rooms, FloorsAreCountedAlongTheLongestChain) {
  EXPECT_EQ(floorsOf("a.cpp", {{"a.cpp", {"a.hpp", "c.hpp"}}, {"a.hpp", {"b.hpp"}}, {"b.hpp", {"c.hpp"}}}), 4);
  EXPECT_EQ(floorsOf("alone.cpp", {}), 1);
  EXPECT_EQ(floorsOf("a.hpp", {{"a.hpp", {"b.hpp"}}, {"b.hpp", {"a.hpp"}}}), std::nullopt);
}

int linesOf(const fs::path& file) {
  std::ifstream stream(file);
  return static_cast<int>(std::count(std::istreambuf_iterator<char>(stream), {}, '\n'));
}

/// A newcomer reads a room of the motion side in an evening.
TEST(Rooms, NoneOfTheMotionSideIsLarge) {
  constexpr int kMost = 2400;  // lines
  for (const std::string room : {"motion", "matching", "map", "belief", "rig", "odometry"}) {
    int lines = 0;
    for (const fs::path& file : filesOf(room)) lines += linesOf(file);
    EXPECT_LE(lines, kMost) << room;
    EXPECT_GT(lines, 500) << room;
  }
}

/// One thought is one file: few are short. A short header serves more than its own source and one other file, unless
/// that source is a thought of its own by its length.
TEST(Rooms, ShortFilesAreFew) {
  constexpr int kShort = 40, kMost = 47;               // lines; files
  std::map<std::string, std::set<std::string>> users;  // of a header, by its name without ending
  for (const fs::path& parent : {kSource / "include", kSource / "src", kSource / "test", kSource / "lab"})
    for (const fs::path& file : filesBelow(parent)) {
      if (file.extension() != ".hpp" && file.extension() != ".cpp") continue;
      for (const Include& include : includesIn(file))
        if (const fs::path header = fs::path(include.header).stem(); header != file.stem())
          users[header.string()].insert(file.string());
    }
  int files = 0;
  for (const auto& [room, others] : kMayInclude)
    for (const fs::path& file : filesOf(room)) {
      if (linesOf(file) >= kShort) continue;
      ++files;
      const std::string name = file.stem().string();
      const bool is_public = *file.lexically_relative(kSource).begin() == "include";
      const fs::path source = (is_public ? kSource / "src" / room : file.parent_path()) / (name + ".cpp");
      if (file.extension() != ".hpp" || (fs::exists(source) && linesOf(source) > 2 * kShort)) continue;
      EXPECT_GT(users[name].size(), 1u) << file << " has one user";
    }
  EXPECT_LE(files, kMost);
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

/// OpenCV's readers of image files bring a hundred libraries into a robot's processes; cv_bridge, which has them as
/// well, is for `messages` alone.
TEST(Rooms, WhatRunsOnARobotReadsNoImageFilesWithOpenCv) {
  for (const std::string room :
       {"common", "front_end", "motion", "matching", "map", "belief", "rig", "odometry", "places", "config", "ros"})
    for (const Include& include : includesOf(room))
      EXPECT_TRUE(include.header != "opencv2/imgcodecs.hpp" && include.header != "opencv2/highgui.hpp" &&
                  include.header != "opencv2/opencv.hpp" && include.header.rfind("cv_bridge/", 0) != 0)
          << include.file.string() << ":" << include.line << " includes " << include.header;
}

/// Public is what a program, a nodelet or an example includes, and what that includes; all else stands in src/.
TEST(Rooms, EveryPublicHeaderIsReachedFromAnEntryPoint) {
  const fs::path include = kSource / "include";
  std::set<std::string> reached;
  const std::function<void(const fs::path&)> follow = [&](const fs::path& file) {
    for (const auto& [user, line, header] : includesIn(file))
      if (fs::exists(include / header) && reached.insert(header).second) follow(include / header);
  };
  for (const char* folder : {"src/tools", "src/config", "src/ros", "src/messages", "src/check", "examples"})
    for (const fs::path& file : filesBelow(kSource / folder)) follow(file);
  for (const fs::path& file : filesBelow(include))
    EXPECT_EQ(reached.count(file.lexically_relative(include).string()), 1u) << file;
}

/// A user reads them in half an hour.
TEST(Rooms, PublicHeadersAreFew) {
  EXPECT_LE(filesBelow(kSource / "include").size(), 20u);
}

/// With one sentence, before anything that only C++17 has. Headers that include another one of ours leave it to that
/// one.
TEST(Rooms, EveryPublicHeaderRefusesOlderStandards) {
  const fs::path include = kSource / "include";
  std::set<std::string> public_headers, guarded;
  for (const fs::path& file : filesBelow(include))
    if (file.extension() == ".hpp") public_headers.insert(file.lexically_relative(include).string());
  for (const std::string& header : public_headers)
    for (const Include& included : includesIn(include / header))
      if (public_headers.count(included.header) > 0) guarded.insert(header);
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
  for (const char* line : {"#include <ros/ros.h>", "#include \"../messages/pose_conversions.hpp\"",
                           "  #  include <ros/time.h>", "#include <sensor_msgs/Image.h>", "#include <tf2_ros/buffer.h>",
                           "#include <cv_bridge/cv_bridge.h>", "#include \"stereo_descriptor_vo/StereoFeatures.h\"",
                           "#include <stereo_descriptor_vo/messages/stereo_features_view.hpp>"})
    EXPECT_TRUE(isRos(headerOf(line))) << line;
  for (const char* line : {"#include <cstdint>", "#include <opencv2/core.hpp>", "#include <Eigen/Geometry>",
                           "#include \"stereo_descriptor_vo/common/stereo_features.hpp\"",
                           "#include \"freak_pairs.inc\"", "// #include <ros/ros.h> would not do"})
    EXPECT_FALSE(isRos(headerOf(line))) << line;
}

TEST(Rooms, TheSearchKnowsTheRoomOfAHeader) {
  const fs::path source = kSource / "src";
  EXPECT_EQ(roomOf("stereo_descriptor_vo/map/local_map.hpp"), "map");
  EXPECT_EQ(roomOf(fromItsRoom(source / "tools" / "convert.cpp", "../common/text.hpp")), "common");
  EXPECT_EQ(roomOf(fromItsRoom(source / "matching" / "patch_samples.cpp", "patch_samples.hpp")), "matching");
  EXPECT_EQ(roomOf(fromItsRoom(source / "ros" / "transforms" / "imu_input.hpp", "../../common/text.hpp")), "common");
  EXPECT_EQ(roomOf(fromItsRoom(source / "ros" / "nodelets" / "robot_nodelet.hpp", "../node/threads.hpp")), "ros");
  EXPECT_EQ(roomOf("opencv2/core.hpp"), "");
  EXPECT_EQ(roomOf("stereo_descriptor_vo/messages/stereo_features_view.hpp"), "messages");
  EXPECT_EQ(roomOf(fromItsRoom(source / "odometry" / "outage.cpp", "vector")), "");
}

}  // namespace
