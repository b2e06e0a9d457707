#include "output_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <tf2_eigen/tf2_eigen.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <stdexcept>
#include <system_error>

namespace fs = std::filesystem;

namespace sdvo {

namespace {

void check(bool succeeded) {
  if (!succeeded) throw std::system_error(errno, std::generic_category());
}

/// Closed with its owner; synchronise() returns once the disk has what was written.
class Descriptor {
 public:
  explicit Descriptor(int file) : file_(file) { check(file >= 0); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { ::close(file_); }
  void synchronise() const { check(::fsync(file_) == 0 || errno == EINVAL); }  // EINVAL: a file system without it
  void allow(mode_t mode) const { check(::fchmod(file_, mode) == 0); }

 private:
  const int file_;
};

/// The file that `path` leads to, over links that may lead to nothing yet.
fs::path followLinks(fs::path path) {
  constexpr int kMostLinks = 40;  // the kernel's own limit
  std::error_code ignored;
  for (int links = 0; fs::is_symlink(path, ignored); ++links) {
    if (links == kMostLinks) throw std::system_error(ELOOP, std::generic_category());
    path = path.parent_path() / fs::read_symlink(path);
  }
  return path;
}

/// Of the file that is replaced, else as any program's new file.
mode_t modeOf(const fs::path& path) {
  static const mode_t mask = [] {
    const mode_t found = ::umask(077);  // it can only be read by setting it
    ::umask(found);
    return found;
  }();
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_mode & 07777 : 0666 & ~mask;
}

void replace(const fs::path& path, const std::function<void(const std::string& partial)>& write) {
  std::string partial = path.string() + ".partial-XXXXXX";
  const Descriptor file(::mkstemp(partial.data()));
  try {
    write(partial);
    file.allow(modeOf(path));
    file.synchronise();
    fs::rename(partial, path);
  } catch (...) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw;
  }
  Descriptor(::open(path.parent_path().c_str(), O_RDONLY | O_DIRECTORY)).synchronise();
}

}  // namespace

void writeWhole(const std::string& path, const std::function<void(const std::string& partial)>& write) {
  const auto fail = [&](const std::string& why) { throw std::runtime_error("'" + path + "': " + why); };
  if (!fs::path(path).is_absolute()) fail("the path must be absolute");
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) fail("it is no regular file");
  try {
    replace(followLinks(path), write);
  } catch (const std::system_error& e) {
    fail("cannot be written: " + e.code().message());
  } catch (const std::exception& e) {
    fail(std::string("cannot be written: ") + e.what());
  }
}

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

void saveTrajectory(const nav_msgs::Path& poses, const Eigen::Isometry3d& T_base_camera, const std::string& format,
                    const std::string& path) {
  if (format != "tum" && format != "kitti")
    throw std::runtime_error("'" + path + "': format '" + format + "' is neither tum nor kitti");
  writeWhole(path, [&](const std::string& partial) {
    errno = 0;
    std::ofstream out(partial);
    out.precision(12);
    if (format == "tum")
      writeTum(poses, out);
    else
      writeKitti(poses, T_base_camera, out);
    out.close();
    if (!out) throw std::runtime_error(std::strerror(errno));
  });
}

}  // namespace sdvo
