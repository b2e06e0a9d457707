#include "axes_check.hpp"

#include <algorithm>
#include <cmath>

#include "../common/text.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

Finding checkMount(const std::string& base_frame, const std::string& camera_frame,
                   const Eigen::Isometry3d& T_base_camera) {
  const Eigen::Vector3d at = T_base_camera.translation(), ahead = T_base_camera.linear().col(2);
  if (camera_frame == base_frame && base_frame != "base_link") return {Verdict::kOk, "the base is the camera"};
  // An optical frame looks along +z, on a robot seldom up.
  return warnIf(T_base_camera.linear().isIdentity(1e-3),
                text(2, camera_frame, " is at ", at.x(), " ", at.y(), " ", at.z(), " m of ", base_frame,
                     " and looks along ", ahead.x(), " ", ahead.y(), " ", ahead.z()),
                "camera frame '" + camera_frame +
                    "' has the axes of the base (x forward): an optical frame (x right, "
                    "z forward) was expected; name it as the images' frame_id");
}

void OpticalAxisCheck::add(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_previous_current) {
  constexpr double kUp = 0.7;  // cosine of 45 degrees
  if (T_base_camera.linear()(2, 2) < kUp) return;
  const Eigen::Vector3d turn = logSO3(T_previous_current.linear());
  along_axis_ += T_previous_current.translation().z();
  distance_ += T_previous_current.translation().norm();
  about_axis_ += std::abs(turn.z());
  about_others_ += turn.head<2>().norm();
  is_sideways_ = std::abs(T_base_camera.linear()(0, 0)) < kUp;
}

Finding OpticalAxisCheck::judge() const {
  constexpr double kEnough = 0.5;  // m (chosen)
  constexpr double kAlong = 0.8;   // ratio (chosen): a robot under a ceiling camera drives across its axis
  if (distance_ < kEnough) return {Verdict::kOpen, "no motion of a camera that looks up"};
  const std::string what = text(1, "TF has the camera look up, and it moves along its axis by ", along_axis_, " of ",
                                distance_, " m: the robot rises");
  constexpr double kTurned = 15.0 * M_PI / 180.0;  // rad (chosen): more than a hand or a rotor shakes a straight way
  const bool may_rise = is_sideways_ && (about_others_ < kTurned || about_others_ < about_axis_);
  if (may_rise || std::abs(along_axis_) < kAlong * distance_) return {Verdict::kOk, what};
  return {
      Verdict::kWarn, what,
      "the images' frame_id names a body's frame (x ahead) instead of an optical one (z ahead), or lacks its rotation"};
}

void GyroAxesCheck::Turns::add(const Eigen::Vector3d& by_gyro, const Eigen::Vector3d& by_images) {
  product += by_gyro.dot(by_images);
  of_gyro += by_gyro.squaredNorm();
  of_images += by_images.squaredNorm();
}

double GyroAxesCheck::Turns::cosine() const {
  return std::clamp(product / std::sqrt(std::max(of_gyro * of_images, 1e-300)), -1.0, 1.0);
}

void GyroAxesCheck::add(std::int64_t from, std::int64_t to, const Eigen::Matrix3d& by_gyro,
                        const Eigen::Matrix3d& by_images) {
  constexpr double kLeast = 0.2 * M_PI / 180.0;  // rad, as much as bias and noise give
  constexpr double kKept = 60.0 * M_PI / 180.0;  // rad, thrice what suffices
  const Pair pair{from, to, logSO3(by_gyro), logSO3(by_images)};
  // Shaking turns the gyro of a standing robot alone. Counted as turns, an hour of it would outweigh the next turn.
  if (pair.by_images.norm() < kLeast) return;
  turned_ += pair.by_images.norm();
  pairs_.push_back(pair);
  for (; turned_ - pairs_.front().by_images.norm() > kKept; pairs_.pop_front())
    turned_ -= pairs_.front().by_images.norm();
}

Finding GyroAxesCheck::judge(const Gyro& gyro) const {
  constexpr double kEnough = 20.0 * M_PI / 180.0;  // rad
  constexpr double kAgree = 0.7, kMost = 2.0;      // cosine; ratio of the rates
  if (turned_ < kEnough) return {Verdict::kOpen, "the camera did not turn enough", "turn it"};
  const auto degrees = [](double cosine) { return 180.0 / M_PI * std::acos(cosine); };
  Turns turns;
  for (const Pair& pair : pairs_) turns.add(pair.by_gyro, pair.by_images);
  const double ratio = std::sqrt(turns.of_gyro / turns.of_images);
  const std::string what = text(1, "gyro and images turn about axes ", degrees(turns.cosine()),
                                " degrees apart, by angles of ratio ", ratio);
  if (ratio > kMost) return {Verdict::kWarn, what, "is angular_velocity in rad/s, and of this camera's IMU?"};
  // If the gyro turns less than the images, a moving object may fill the view.
  if (turns.cosine() >= kAgree || ratio * kMost <= 1.0) return {Verdict::kOk, what};
  constexpr int kSteps = 15;                    // to either side
  constexpr std::int64_t kStep = 10'000'000;    // ns
  constexpr double kFound = 0.9, kKnown = 0.5;  // cosine; ratio of the pairs' turns that must be there
  double best = kFound;
  std::int64_t shift = 0;
  for (std::int64_t k = -kSteps; k <= kSteps; ++k) {
    Turns shifted;
    for (const Pair& pair : pairs_)
      if (const auto turn = gyro(pair.from + k * kStep, pair.to + k * kStep))
        shifted.add(logSO3(*turn), pair.by_images);
    if (shifted.of_images < kKnown * turns.of_images || shifted.cosine() <= best) continue;
    best = shifted.cosine();
    shift = k * kStep;
  }
  if (shift == 0) return {Verdict::kWarn, what, "is the IMU mounted as TF has its frame?"};
  return {Verdict::kWarn, what,
          text(0, "its stamps are ", std::abs(1e-6 * static_cast<double>(shift)), " ms too ",
               shift > 0 ? "late" : "early", ", with which axes agree to ", degrees(best),
               " degrees: let the driver correct them (Kalibr's timeshift_cam_imu)")};
}

}  // namespace sdvo
