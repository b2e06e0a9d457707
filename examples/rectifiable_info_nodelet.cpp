#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/distortion_models.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <pluginlib/class_list_macros.hpp>
#include <set>
#include <stdexcept>
#include <string>

namespace examples {

/// Hands on the camera_info that image_proc can rectify by, to rectifiable/camera_info. At any other one image_proc's
/// exception would end the whole manager. Further names of a lens model become image_proc's, and P that of ~fov (deg
/// from side to side; 0: as calibrated).
class RectifiableInfoNodelet : public nodelet::Nodelet {
 private:
  using Info = sensor_msgs::CameraInfo;

  void onInit() override {
    ros::NodeHandle nh = getNodeHandle();
    fov_ = getPrivateNodeHandle().param("fov", 0.0);
    if (!(fov_ >= 0.0 && fov_ <= kWidest)) throw std::invalid_argument("~fov is between 0 and 170 deg");
    publisher_ = nh.advertise<Info>("rectifiable/camera_info", kQueue);
    subscriber_ = nh.subscribe<Info>("camera_info", kQueue, [this](const Info::ConstPtr& info) { take(info); });
  }

  void take(const Info::ConstPtr& given) {
    static const std::set<std::string> fisheyes = {"fisheye", "kannala_brandt", "kannala_brandt4"};
    const auto info = boost::make_shared<Info>(*given);
    if (fisheyes.count(info->distortion_model) > 0)
      info->distortion_model = sensor_msgs::distortion_models::EQUIDISTANT;
    if (info->distortion_model == sensor_msgs::distortion_models::EQUIDISTANT && info->D.size() == 5 &&
        info->D[4] == 0.0)
      info->D.pop_back();  // a T265's driver fills up with a zero
    const std::string problem = whyUnrectifiable(*info);
    if (!problem.empty()) {
      NODELET_ERROR_STREAM_THROTTLE(kPeriod, subscriber_.getTopic() << ": no image is rectified: " << problem);
      return;
    }
    if (fov_ > 0.0 && info->P[0] > 0.0) {
      const double f = 0.5 * info->width / std::tan(0.5 * fov_ * M_PI / 180.0);
      info->P = {f,
                 0.0,
                 0.5 * (info->width - 1.0),
                 info->P[3] * f / info->P[0],
                 0.0,
                 f,
                 0.5 * (info->height - 1.0),
                 0.0,
                 0.0,
                 0.0,
                 1.0,
                 0.0};
    }
    publisher_.publish(info);
  }

  static std::string whyUnrectifiable(const Info& info) {
    namespace models = sensor_msgs::distortion_models;
    const auto isZero = [](double number) { return number == 0.0; };
    const auto isFinite = [](double number) { return std::isfinite(number); };
    if (std::all_of(info.D.begin(), info.D.end(), isZero)) return "";  // image_proc hands such images on
    const std::string model = "distortion_model '" + info.distortion_model + "'";
    const bool is_fisheye = info.distortion_model == models::EQUIDISTANT;
    if (!is_fisheye && info.distortion_model != models::PLUMB_BOB &&
        info.distortion_model != models::RATIONAL_POLYNOMIAL)
      return model +
             " is unknown to image_proc: plumb_bob, rational_polynomial and equidistant (fisheye, "
             "kannala_brandt4) work";
    const std::set<std::size_t> sizes = is_fisheye ? std::set<std::size_t>{4} : std::set<std::size_t>{4, 5, 8, 12, 14};
    if (sizes.count(info.D.size()) == 0)
      return model + " with " + std::to_string(info.D.size()) +
             " numbers in D: " + (is_fisheye ? "4 are expected" : "4, 5, 8, 12 or 14 are expected");
    if (!std::all_of(info.D.begin(), info.D.end(), isFinite) || !std::all_of(info.K.begin(), info.K.end(), isFinite) ||
        !std::all_of(info.R.begin(), info.R.end(), isFinite) || !std::all_of(info.P.begin(), info.P.end(), isFinite))
      return "a number in D, K, R or P is not finite";
    return "";
  }

  static constexpr int kQueue = 10;
  static constexpr double kPeriod = 5.0;    // s between errors
  static constexpr double kWidest = 170.0;  // deg

  double fov_ = 0.0;  ///< deg

  ros::Publisher publisher_;
  ros::Subscriber subscriber_;
};

}  // namespace examples

PLUGINLIB_EXPORT_CLASS(examples::RectifiableInfoNodelet, nodelet::Nodelet)
