#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <stereo_descriptor_vo/PlaceInfo.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "../messages/place_conversions.hpp"
#include "odometry_pair_input.hpp"
#include "places_file.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"

namespace sdvo {

/// The places and all that begins anew with them. Not for several threads at once.
class PlaceSession {
 public:
  explicit PlaceSession(const PlaceRecognitionOptions& options)
      : localises_only_(options.localisation_only), recognition_(options) {}

  /// Begins with the places of an earlier session. Throws std::invalid_argument when they do not belong together.
  PlaceSession(const PlaceRecognitionOptions& options, SavedPlaces saved);

  /// What a pair does to time. Stamps that fall are a new beginning with simulated time that jumped back, and nothing
  /// but an unknown way in between when a driver restarted or the system's clock was set back.
  enum class Time { kGoesOn, kStands, kFell, kBeganAnew };
  Time noteTime(const ros::Time& stamp, const ros::Time& now, bool is_simulated);

  /// Takes the next pair; a report where it became a key frame. Throws std::invalid_argument for another camera than
  /// that of the places, other descriptors, and messages that do not hold together.
  std::optional<PlaceReport> observe(const OdometryPair& pair, const Eigen::Isometry3d& T_base_camera);

  /// Takes a pose of the base in the map, as from rviz' "2D Pose Estimate". From the next pair on the odometry is
  /// there, and until a place is recognised only those nearby are looked at. Returns what this does, in words. Throws
  /// std::invalid_argument for a pose that is not of `map_frame`, and for numbers that are not finite.
  std::string expect(const geometry_msgs::PoseWithCovarianceStamped& pose, const std::string& map_frame);

  /// Throws std::invalid_argument where the places are not of the camera and the descriptors that `session` saw last.
  void refuseOtherCameraThan(const PlaceSession& session) const;

  PlaceRecognition& recognition() { return recognition_; }
  const PlaceRecognition& recognition() const { return recognition_; }
  ros_conversions::MapState map() const;
  std::vector<Place> places() const;
  const ros_conversions::FeatureStream& stream() const { return stream_; }
  const std::string& odomFrame() const { return odom_frame_; }
  std::optional<stereo_descriptor_vo::Place> message(int id, const std::string& robot) const;
  std::optional<stereo_descriptor_vo::PlaceSignature> signature(int id, const std::string& robot) const;
  /// But for the header and the counts of what came in.
  stereo_descriptor_vo::PlaceInfo info(const PlaceReport& report) const;
  /// Of the base in the map, at the newest key frame; none while its covariance is unknown. Frame and stamp are the
  /// caller's to fill.
  std::optional<geometry_msgs::PoseWithCovarianceStamped> basePose(const Eigen::Isometry3d& T_base_camera) const;

  /// Places that look like another robot's, the best first. Throws std::invalid_argument where words differ in kind.
  std::vector<PlaceCandidate> find(const stereo_descriptor_vo::PlaceSignature& signature) const;
  /// The geometric match of place `id` with another robot's; none where they are not the same place.
  std::optional<stereo_descriptor_vo::PlaceMatch> verify(int id, const Place& other) const;

  /// Whether it is known where in the places that were loaded the odometry is; true when none were.
  bool isLocated() const { return located_; }
  /// … or somebody said where.
  bool isPlaced() const { return located_ || told_; }
  /// Whether the map grows around an odometry that has its place in it.
  bool isMapping() const { return located_ && !localises_only_; }
  /// Of the last optimisation, s.
  double optimise_time = 0.0;

 private:
  /// Of the last pair observed.
  struct Last {
    ros::Time stamp, session;
    std::uint32_t epoch;
    int resumes;
    StereoCamera camera;
    Eigen::Isometry3d T_odom_base;
  };

  void refuse(const StereoCamera& camera, const std::optional<DescriptorKind>& kind) const;

  const bool localises_only_;
  PlaceRecognition recognition_;
  std::string odom_frame_;
  ros_conversions::FeatureStream stream_;
  std::optional<Last> last_;
  std::optional<DescriptorKind> kind_;  ///< none before the first features: a dark pair has none
  std::optional<ros::Time> last_now_;
  bool clock_fell_ = false;  ///< since the stamps did
  bool continues_ = false;   ///< the next pair's motion since the last one is known
  int loaded_ = 0;           ///< places with smaller ids were loaded
  bool located_ = true;
  bool told_ = false;
  struct Expectation {
    Eigen::Isometry3d T_map_base;
    double radius;
  };
  std::optional<Expectation> expected_;
};

}  // namespace sdvo
