#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

/// The header that a line includes, if that header is ROS's or made by its build; else empty. Debian installs ROS
/// headers in /usr/include, so the compiler would find them without being told where to look.
std::string rosHeaderIncludedBy(const std::string& line) {
  static const std::regex include(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  static const std::regex ros(
      R"(^(\.\./)*(ros|tf|nodelet|nodelet_topic_tools|cv_bridge|rosbag|rosbag_storage|message_filters|image_transport|pluginlib|)"
      R"(class_loader|image_geometry|dynamic_reconfigure|diagnostic_updater|actionlib|bondcpp|xmlrpcpp|rosconsole|)"
      R"(catkin|topic_tools|angles|eigen_conversions)/.*|^tf2.*/.*|^[A-Za-z0-9_]+_msgs/.*|^std_srvs/.*|)"
      R"(^stereo_descriptor_vo/[A-Z].*|^stereo_descriptor_vo/ros/.*)");
  std::smatch match;
  if (!std::regex_search(line, match, include)) return "";
  const std::string header = match[1];
  return std::regex_match(header, ros) ? header : "";
}

std::vector<fs::path> coreFiles() {
  std::vector<fs::path> files;
  const fs::path source = SDVO_SOURCE_DIR;
  for (const fs::path& directory : {source / "include" / "stereo_descriptor_vo", source / "src"})
    for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
      const std::string extension = entry.path().extension().string();
      if (entry.is_regular_file() && (extension == ".hpp" || extension == ".cpp" || extension == ".inc"))
        files.push_back(entry.path());
    }
  return files;
}

TEST(NoRosInCore, TheSearchKnowsRosHeaders) {
  for (const char* line :
       {"#include <ros/ros.h>", "#include \"ros/conversions.hpp\"", "  #  include <ros/time.h>",
        "#include <sensor_msgs/Image.h>", "#include <nav_msgs/Odometry.h>", "#include <tf2/utils.h>",
        "#include <tf2_ros/buffer.h>", "#include <nodelet/nodelet.h>", "#include <cv_bridge/cv_bridge.h>",
        "#include <message_filters/subscriber.h>", "#include <image_transport/image_transport.h>",
        "#include <rosbag/bag.h>", "#include <pluginlib/class_list_macros.hpp>",
        "#include \"stereo_descriptor_vo/StereoFeatures.h\"",
        "#include <stereo_descriptor_vo/ros/stereo_features_view.hpp>"})
    EXPECT_FALSE(rosHeaderIncludedBy(line).empty()) << line;
  for (const char* line : {"#include <cstdint>", "#include <opencv2/core.hpp>", "#include <Eigen/Geometry>",
                           "#include \"stereo_descriptor_vo/stereo_features.hpp\"", "#include \"freak_pairs.inc\"",
                           "// #include <ros/ros.h> would not do"})
    EXPECT_TRUE(rosHeaderIncludedBy(line).empty()) << line;
}

TEST(NoRosInCore, NoCoreFileIncludesARosHeader) {
  const std::vector<fs::path> files = coreFiles();
  ASSERT_GE(files.size(), 20u) << "the core was not found under " << SDVO_SOURCE_DIR;
  for (const fs::path& file : files) {
    std::ifstream stream(file);
    ASSERT_TRUE(stream) << file;
    std::string line;
    for (int number = 1; std::getline(stream, line); ++number)
      EXPECT_EQ(rosHeaderIncludedBy(line), "") << file.string() << ":" << number;
  }
}

}  // namespace
