// Plays a drive to both nodelets, which live in this process as they would in a camera's manager, and tells how long
// odometry takes from the stamp, and how much of that is the core's own work: lab/run benchmark runs this.
#include <nav_msgs/Odometry.h>
#include <nodelet/loader.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <stereo_descriptor_vo/VoInfo.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

namespace {

const std::string kNamespace = "/latency/", kFrame = "latency_left_optical";

sensor_msgs::Image toMessage(const cv::Mat& image) {
  sensor_msgs::Image message;
  message.header.frame_id = kFrame;
  message.width = static_cast<std::uint32_t>(image.cols), message.height = static_cast<std::uint32_t>(image.rows);
  message.encoding = "mono8";
  message.step = message.width;
  const cv::Mat whole = image.clone();
  message.data.assign(whole.datastart, whole.dataend);
  return message;
}

/// Of the left camera (0) or the right one (1).
sensor_msgs::CameraInfo toMessage(const sdvo::StereoCamera& camera, int side) {
  sensor_msgs::CameraInfo info;
  info.header.frame_id = kFrame;
  info.width = static_cast<std::uint32_t>(camera.width), info.height = static_cast<std::uint32_t>(camera.height);
  info.distortion_model = "plumb_bob";
  info.D.assign(5, 0.0);
  info.K = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  info.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.P = {camera.fx, 0.0, camera.cx, -camera.fx * camera.baseline * side, 0.0, camera.fy, camera.cy, 0.0, 0.0,
            0.0,       1.0, 0.0};
  return info;
}

/// Of a camera that looks ahead, at the base's origin.
geometry_msgs::TransformStamped transformOfCamera() {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = "base_link", transform.child_frame_id = kFrame;
  auto& q = transform.transform.rotation;
  q.x = -0.5, q.y = 0.5, q.z = -0.5, q.w = 0.5;
  return transform;
}

/// Latencies of the messages that come back, ms, by stamp.
class Answers {
 public:
  void takeOdometry(const nav_msgs::Odometry& odometry) {
    const double latency = (ros::Time::now() - odometry.header.stamp).toSec() * 1e3;
    const std::lock_guard<std::mutex> lock(mutex_);
    latencies_[odometry.header.stamp] = latency;
  }
  void takeInfo(const stereo_descriptor_vo::VoInfo& info) {
    const std::lock_guard<std::mutex> lock(mutex_);
    own_[info.header.stamp] =
        1e3 * (info.detect_time + info.stereo_time + info.describe_time + info.match_time + info.motion_time);
    dropped_ = info.dropped_pairs + info.dropped_features;
  }

  void print(double rate, int published) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<double> latencies, own, over;
    for (const auto& [stamp, latency] : latencies_) {
      const auto of_core = own_.find(stamp);
      if (of_core == own_.end()) continue;
      latencies.push_back(latency), own.push_back(of_core->second), over.push_back(latency - of_core->second);
    }
    std::printf("%g %d %zu %lu %.2f %.2f %.2f %.2f\n", rate, published, latencies.size(),
                static_cast<unsigned long>(dropped_), quantile(own, 0.5), quantile(latencies, 0.5), quantile(over, 0.5),
                quantile(over, 0.95));
  }

 private:
  static double quantile(std::vector<double>& values, double share) {
    if (values.empty()) return -1.0;
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  }

  std::mutex mutex_;
  std::map<ros::Time, double> latencies_, own_;
  std::uint64_t dropped_ = 0;
};

}  // namespace

/// Arguments: a folder in KITTI layout, pairs per second, seconds. Prints the rate, pairs published, poses, pairs
/// dropped, medians in ms of the core's time and of the time from stamp to odometry, median and 95th percentile of the
/// difference.
int main(int argc, char** argv) {
  ros::init(argc, argv, "measure_latency");
  if (argc != 4) return 1;
  const sdvo::KittiSequence sequence(argv[1]);
  const double rate = std::stod(argv[2]), seconds = std::stod(argv[3]);
  constexpr int kMostPairs = 100;
  std::vector<std::array<sensor_msgs::Image, 2>> pairs;
  for (int i = 0; i < std::min(sequence.size(), kMostPairs); ++i) {
    const sdvo::ImagePair pair = sequence.load(i);
    pairs.push_back({toMessage(pair.left), toMessage(pair.right)});
  }

  ros::NodeHandle node(kNamespace);
  tf2_ros::StaticTransformBroadcaster broadcaster;
  broadcaster.sendTransform(transformOfCamera());
  Answers answers;
  const auto odometry = node.subscribe("odom", 100, &Answers::takeOdometry, &answers);
  const auto information = node.subscribe("vo_info", 100, &Answers::takeInfo, &answers);
  ros::Publisher images[2], infos[2];
  const char* const kSides[2] = {"left/", "right/"};
  for (const int side : {0, 1}) {
    images[side] = node.advertise<sensor_msgs::Image>(kSides[side] + std::string("image_rect"), 5);
    infos[side] = node.advertise<sensor_msgs::CameraInfo>(kSides[side] + std::string("camera_info"), 5);
  }
  ros::AsyncSpinner spinner(1);
  spinner.start();
  nodelet::Loader loader(false);
  for (const auto& [name, type] :
       {std::pair("stereo_features", "StereoFeatures"), std::pair("visual_odometry", "VisualOdometry")})
    if (!loader.load(kNamespace + name, std::string("stereo_descriptor_vo/") + type, {}, {})) return 1;
  const auto is_connected = [&] {
    return images[0].getNumSubscribers() * images[1].getNumSubscribers() * infos[0].getNumSubscribers() *
               infos[1].getNumSubscribers() >
           0;
  };
  while (ros::ok() && !is_connected()) ros::WallDuration(0.05).sleep();

  // There and back without an end, so that the motion goes on.
  const int turn = static_cast<int>(pairs.size()) - 1, count = static_cast<int>(rate * seconds);
  ros::Rate pace(rate);
  for (int k = 0; k < count && ros::ok(); ++k) {
    const int i = std::min(k % (2 * turn), 2 * turn - k % (2 * turn));
    boost::shared_ptr<sensor_msgs::Image> image[2];
    boost::shared_ptr<sensor_msgs::CameraInfo> info[2];
    for (const int side : {0, 1}) {
      image[side] =
          boost::make_shared<sensor_msgs::Image>(pairs[static_cast<std::size_t>(i)][static_cast<std::size_t>(side)]);
      info[side] = boost::make_shared<sensor_msgs::CameraInfo>(toMessage(sequence.camera(), side));
    }
    pace.sleep();
    const ros::Time stamp = ros::Time::now();
    for (const int side : {0, 1}) {
      image[side]->header.stamp = info[side]->header.stamp = stamp;
      infos[side].publish(info[side]);
      images[side].publish(image[side]);
    }
  }
  ros::WallDuration(1.0).sleep();
  answers.print(rate, count);
  return 0;
}
