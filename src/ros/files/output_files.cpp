#include "output_files.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <cstdlib>
#include <iomanip>
#include <sstream>
#include <stdexcept>

namespace sdvo {

namespace {

void writeTum(const nav_msgs::Path& poses, std::ostream& out) {
  for (const geometry_msgs::PoseStamped& stamped : poses.poses) {
    const auto& p = stamped.pose.position;
    const auto& q = stamped.pose.orientation;
    out << stamped.header.stamp.sec << "." << std::setw(9) << std::setfill('0') << stamped.header.stamp.nsec << " "
        << p.x << " " << p.y << " " << p.z << " " << q.x << " " << q.y << " " << q.z << " " << q.w << "\n";
  }
}

void writeKitti(const nav_msgs::Path& poses, const Eigen::Isometry3d& T_base_camera, std::ostream& out) {
  Eigen::Isometry3d T_first_odom = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < poses.poses.size(); ++i) {
    Eigen::Isometry3d T_odom_base;
    tf2::fromMsg(poses.poses[i].pose, T_odom_base);
    const Eigen::Isometry3d T_odom_camera = T_odom_base * T_base_camera;
    if (i == 0) T_first_odom = T_odom_camera.inverse();
    const Eigen::Matrix4d pose = (T_first_odom * T_odom_camera).matrix();
    for (int k = 0; k < 12; ++k) out << pose(k / 4, k % 4) << (k < 11 ? " " : "\n");
  }
}

}  // namespace

std::string inRosHome(const std::string& path) {
  const char *ros_home = std::getenv("ROS_HOME"), *home = std::getenv("HOME");
  if (path.empty() || (!ros_home && !home)) return path;
  namespace fs = std::filesystem;
  const bool in_home = home && path.compare(0, 2, "~/") == 0;  // no shell has replaced it
  const fs::path whole = in_home    ? fs::path(home + path.substr(1))
                         : ros_home ? fs::path(ros_home) / path
                                    : fs::path(home) / ".ros" / path;
  std::error_code failed;
  const fs::path real = fs::weakly_canonical(whole, failed);
  return (failed ? whole : real).string();
}

void saveTrajectory(const nav_msgs::Path& poses, const Eigen::Isometry3d& T_base_camera, const std::string& format,
                    const std::string& path) {
  if (format != "tum" && format != "kitti")
    throw std::runtime_error("'" + path + "': format '" + format + "' is neither tum nor kitti");
  std::ostringstream text;
  text.precision(12);
  format == "tum" ? writeTum(poses, text) : writeKitti(poses, T_base_camera, text);
  writeWhole(path, text.str());
}

}  // namespace sdvo
