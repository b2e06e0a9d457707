#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace examples {

/// Cuts the image of a USB stereo camera, both views side by side, into left/image_raw and right/image_raw, with the
/// camera_info of each and the stamp of the whole: a pair by construction. Parameters: ~left_camera_info and
/// ~right_camera_info (YAML files as of camera_calibration or kalibr_to_camera_info.py), ~frame_id (empty: the
/// image's).
class SideBySideSplitterNodelet : public nodelet::Nodelet {
 private:
  void onInit() override try {
    ros::NodeHandle nh = getNodeHandle(), private_nh = getPrivateNodeHandle();
    frame_id_ = private_nh.param<std::string>("frame_id", "");
    const std::string names[] = {"left", "right"};
    for (int side = 0; side < 2; ++side) {
      infos_[side] = read(private_nh.param<std::string>(names[side] + "_camera_info", ""));
      images_[side] = nh.advertise<sensor_msgs::Image>(names[side] + "/image_raw", 10);
      cameras_[side] = nh.advertise<sensor_msgs::CameraInfo>(names[side] + "/camera_info", 10);
    }
    subscriber_ = nh.subscribe("image_raw", 10, &SideBySideSplitterNodelet::split, this);
  } catch (const std::exception& e) {
    NODELET_FATAL_STREAM("not started: " << e.what());
    throw;
  }

  static sensor_msgs::CameraInfo read(const std::string& file) try {
    const YAML::Node yaml = YAML::LoadFile(file);
    const auto numbers = [&](const char* key) { return yaml[key]["data"].as<std::vector<double>>(); };
    const auto fill = [&](auto& array, const char* key) {
      const std::vector<double> values = numbers(key);
      if (values.size() != array.size()) throw std::runtime_error(std::string(key) + " has another size");
      std::copy(values.begin(), values.end(), array.begin());
    };
    sensor_msgs::CameraInfo info;
    info.width = yaml["image_width"].as<std::uint32_t>();
    info.height = yaml["image_height"].as<std::uint32_t>();
    info.distortion_model = yaml["distortion_model"].as<std::string>();
    info.D = numbers("distortion_coefficients");
    fill(info.K, "camera_matrix");
    fill(info.R, "rectification_matrix");
    fill(info.P, "projection_matrix");
    return info;
  } catch (const std::exception& e) {
    throw std::runtime_error("camera_info '" + file + "': " + e.what());
  }

  void split(const sensor_msgs::Image::ConstPtr& whole) try {
    namespace encodings = sensor_msgs::image_encodings;
    const std::uint32_t width = whole->width / 2;
    const std::size_t row = std::size_t{width} * static_cast<std::size_t>(encodings::numChannels(whole->encoding)) *
                            static_cast<std::size_t>(encodings::bitDepth(whole->encoding)) / 8;
    if (whole->step < 2 * row || whole->data.size() < std::size_t{whole->step} * whole->height)
      throw std::runtime_error("an image has fewer bytes than its size needs");
    for (int side = 0; side < 2; ++side) {
      const auto image = boost::make_shared<sensor_msgs::Image>();
      image->header = whole->header;
      if (!frame_id_.empty()) image->header.frame_id = frame_id_;
      image->width = width;
      image->height = whole->height;
      image->encoding = whole->encoding;
      image->is_bigendian = whole->is_bigendian;
      image->step = static_cast<std::uint32_t>(row);
      image->data.resize(row * whole->height);
      for (std::size_t y = 0; y < whole->height; ++y)
        std::copy_n(whole->data.begin() + static_cast<std::ptrdiff_t>(y * whole->step + side * row), row,
                    image->data.begin() + static_cast<std::ptrdiff_t>(y * row));
      const auto info = boost::make_shared<sensor_msgs::CameraInfo>(infos_[side]);
      info->header = image->header;
      cameras_[side].publish(info);
      images_[side].publish(image);
    }
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM_THROTTLE(5.0, e.what());
  }

  std::string frame_id_;
  sensor_msgs::CameraInfo infos_[2];
  ros::Publisher images_[2], cameras_[2];
  ros::Subscriber subscriber_;
};

}  // namespace examples

PLUGINLIB_EXPORT_CLASS(examples::SideBySideSplitterNodelet, nodelet::Nodelet)
