#pragma once

#include <string>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

/// Healthy input for diagnostics: 5 to 60 Hz with a tolerance of a tenth, and nearly all of it used.
struct RateOptions {
  double min_rate = 4.5;     ///< Hz, by stamps
  double max_rate = 66.0;    ///< Hz
  double max_unused = 0.05;  ///< ratio of the last seconds' input (chosen)
};

/// Limits beyond which diagnostics of the image side report a fault (chosen).
struct ImageThresholds {
  double max_gap = 0.005;        ///< s, between the stamps of left and right
  double min_intensity = 20.0;   ///< mean grey level
  double max_intensity = 235.0;  ///< mean grey level
  int min_corners = 100;         ///< detected
  double max_load = 0.9;         ///< of one processor
};

/// Which images make a pair, live and in bags.
struct PairingOptions {
  double sync_tolerance = 0.001;
  bool approximate_sync = false;
  double max_interval = 0.025;  // half of a period at 20 Hz

  /// s between the stamps of a pair.
  double allowedGap() const { return approximate_sync ? max_interval : sync_tolerance; }

  void describe(OptionList& list) {
    list.add("sync_tolerance", sync_tolerance, {0.0, 0.1}, "s",
             "largest difference of stamps of one trigger (less than half of a period); 0: equal stamps only");
    list.add("approximate_sync", approximate_sync,
             "pair images of cameras that are not triggered together, whose stamps differ by up to max_interval; the "
             "difference is taken as the right image's delay");
    list.add("max_interval", max_interval, {1e-4, 1.0}, "s",
             "approximate_sync: largest difference of stamps in a pair");
  }
};

/// Options of the image side's nodelet beside those of FeatureExtractor.
struct StereoInputOptions {
  PairingOptions pairing;
  int sync_queue_size = 20;
  int queue_size = 1;
  double max_rate = 0.0;
  bool find_camera = true;
  int opencv_threads = -1;
  double max_silence = 2.0;  ///< s of wall time without a pair, which /diagnostics call an error (chosen)
  RateOptions rates;
  ImageThresholds thresholds;

  void describe(OptionList& list) {
    pairing.describe(list);
    list.add("sync_queue_size", sync_queue_size, {1, 1000}, "",
             "messages kept per input until those that belong to them have come");
    list.add("queue_size", queue_size, {1, 1000}, "", "pairs that wait while one is processed; the newest win");
    list.add("max_rate", max_rate, {0.0, 1000.0}, "Hz", "pairs processed at most, by their stamps; 0: all");
    list.add("find_camera", find_camera,
             "while nobody publishes the images, take the only stereo camera in the namespace; in the "
             "namespace / only where it is set");
    list.add("opencv_threads", opencv_threads, {-1, 256}, "",
             "OpenCV's threads, of the whole process; 0: none beside the caller's, -1: left as they are");
    list.add("diagnostics/max_unused", rates.max_unused, {0.0, 1.0}, "ratio",
             "/diagnostics and the log warn when more of the last seconds' input is not used");
  }
};

/// Options of the odometry's nodelet beside those of VisualOdometry.
struct OdometryOutputOptions {
  std::string odom_frame_id = "odom";
  std::string base_frame_id = "base_link";
  std::string initial_pose = "0 0 0 0 0 0";
  bool publish_tf = true;
  bool invert_tf = false;
  bool publish_null_when_lost = false;
  std::string guess_frame_id;
  bool use_imu = false;
  double guess_timeout = 0.1;
  double guess_min_translation = 0.0;
  double guess_min_rotation = 0.0;
  double guess_min_time = 0.0;
  std::string ground_truth_frame_id;
  std::string ground_truth_base_frame_id;
  int queue_size = 1;
  bool overwrite = false;
  double max_silence = 2.0;  ///< s of wall time without features, which /diagnostics call an error (chosen)
  RateOptions rates;

  /// Whether TF gets odom -> guess_frame_id, for base has that odometry's parent.
  bool correctsGuess() const { return publish_tf && !invert_tf && !guess_frame_id.empty(); }

  /// Whether pairs are left out while the guess hardly moves.
  bool awaitsMotion() const { return guess_min_translation > 0.0 || guess_min_rotation > 0.0; }

  /// Whether the base moved so little (m, rad), and the last processed pair is so young (s), that the next is left out.
  bool isLeftOut(double translation, double rotation, double age) const {
    return awaitsMotion() && (guess_min_translation <= 0.0 || translation < guess_min_translation) &&
           (guess_min_rotation <= 0.0 || rotation < guess_min_rotation) &&
           (guess_min_time <= 0.0 || age < guess_min_time);
  }

  void describe(OptionList& list) {
    list.add("odom_frame_id", odom_frame_id, "world-fixed frame of the odometry");
    list.add("base_frame_id", base_frame_id, "the robot's frame, whose pose is published");
    list.add("initial_pose", initial_pose,
             "pose of the base in odom at the start and after a reset: 'x y z roll pitch yaw' (m, rad), as in URDF");
    list.add("publish_tf", publish_tf,
             "publish odom -> base on /tf, with guess_frame_id odom -> guess_frame_id, also while LOST");
    list.add("invert_tf", invert_tf, "publish base -> odom instead, where base already has a parent");
    list.add("publish_null_when_lost", publish_null_when_lost,
             "while LOST publish odometry of zeros, quaternion included, with variances of 9999, as rtabmap does");
    list.add("guess_frame_id", guess_frame_id,
             "world-fixed frame of another odometry: where its guess_frame_id -> base on TF has the base is one more "
             "place to look for the motion; empty: none");
    list.add("use_imu", use_imu,
             "look for the rotation where the gyro of topic imu has it, too, and take roll and pitch of the first pose "
             "from its "
             "accelerometer while the robot stands; not with guess_frame_id");
    list.add(
        "guess_min_translation", guess_min_translation, {0.0, 10.0}, "m",
        "by guess_frame_id: pairs are left out until the base has moved so far since the last one that was not, or "
        "turned by guess_min_rotation; once it stands for a second, the images rest, too; 0: no such limit");
    list.add("guess_min_rotation", guess_min_rotation, {0.0, 3.0}, "rad", "the same by the base's turn");
    list.add("guess_min_time", guess_min_time, {0.0, 3600.0}, "s",
             "a pair that is so much later than the last one is not left out; 0: no such limit");
    list.add("ground_truth_frame_id", ground_truth_frame_id,
             "world-fixed frame of the base's true pose on TF: the odometry starts there, and topic ground_truth_error "
             "has its error; empty: none");
    list.add("ground_truth_base_frame_id", ground_truth_base_frame_id,
             "the base below ground_truth_frame_id; needed with publish_tf, as a frame on TF has one parent; empty: "
             "base_frame_id");
    list.add("guess_timeout", guess_timeout, {0.0, 1.0}, "s",
             "wall time to wait at each pair for the motion by guess_frame_id or the gyro; seldom once it did not come "
             "in time");
    list.add("queue_size", queue_size, {1, 1000}, "",
             "feature messages that wait while one is processed; the newest win");
    list.add("overwrite", overwrite, "save_trajectory may replace files that were there before");
  }
};

/// Options of the place recognition's nodelet beside those of PlaceRecognition.
struct PlaceOutputOptions {
  std::string map_frame_id = "map";
  bool publish_tf = true;
  int sync_queue_size = 100;
  int queue_size = 10;
  double max_silence = 10.0;  ///< s of wall time without a pair, which /diagnostics warn of (chosen)
  std::string places_file;
  bool save_at_shutdown = false;
  bool overwrite = false;
  std::string robot_name;
  bool initialpose_while_mapping = false;

  void describe(OptionList& list) {
    list.add("map_frame_id", map_frame_id, "frame of the corrected poses, parent of the odometry's frame");
    list.add("publish_tf", publish_tf, "publish map -> odom on /tf");
    list.add("sync_queue_size", sync_queue_size, {2, 10000}, "",
             "messages kept per input until those that belong to them have come");
    list.add("queue_size", queue_size, {1, 10000}, "", "pairs that wait while one is processed; the newest win");
    list.add("places_file", places_file,
             "file of save_places to begin with, relative ones below ROS_HOME; empty: with no places");
    list.add("save_at_shutdown", save_at_shutdown,
             "write the places to places_file, which it needs, each minute and at the end; not with localisation_only");
    list.add("overwrite", overwrite,
             "files that are none of save_places, and maps with other or more places, may be replaced");
    list.add("robot_name", robot_name, "what other robots know this one by; empty: the namespace");
    list.add("initialpose_while_mapping", initialpose_while_mapping,
             "take poses on initialpose also where no map was loaded, or when the robot is found in it already");
  }
};

}  // namespace sdvo
