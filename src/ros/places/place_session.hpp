#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <stereo_descriptor_vo/PlaceInfo.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "../../messages/place_conversions.hpp"
#include "../files/places_file.hpp"
#include "../synchronisation/odometry_pair_input.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"

namespace sdvo {

/// A map of places from its beginning to the next reset or load. Not thread-safe.
class PlaceSession {
 public:
  explicit PlaceSession(const PlaceRecognitionOptions& options)
      : localises_only_(options.localisation_only), recognition_(options) {}

  /// Begins with saved places. Throws std::invalid_argument if they are inconsistent.
  PlaceSession(const PlaceRecognitionOptions& options, SavedPlaces saved);

  /// How a pair's stamp follows the last one. Stamps that fall with simulated time begin anew (a bag is played again).
  /// Otherwise a driver restarted or the system's clock was set back: only the motion in between is unknown.
  enum class Time { kGoesOn, kStands, kFell, kBeganAnew };
  Time noteTime(const ros::Time& stamp, const ros::Time& now, bool is_simulated);

  /// Takes the next pair. Returns a report if it became a key frame. Throws std::invalid_argument for another camera or
  /// other descriptors than those of the places, and for inconsistent messages.
  std::optional<PlaceReport> observe(const OdometryPair& pair, const Eigen::Isometry3d& T_base_camera);

  /// Takes a pose of the base in the map, such as rviz' "2D Pose Estimate". It holds from the next pair on, and until a
  /// place is recognised only places nearby are compared. Returns the effect in words. Throws std::invalid_argument for
  /// a pose in another frame than `map_frame`, and for numbers that are not finite.
  std::string expect(const geometry_msgs::PoseWithCovarianceStamped& pose, const std::string& map_frame);

  /// Throws std::invalid_argument if camera or descriptors of the places differ from the last ones of `session`.
  void refuseOtherCameraThan(const PlaceSession& session) const;

  PlaceRecognition& recognition() { return recognition_; }
  const PlaceRecognition& recognition() const { return recognition_; }
  ros_conversions::MapState map() const;
  SavedPlaces saved() const;
  const std::string& odomFrame() const { return odom_frame_; }
  std::optional<stereo_descriptor_vo::Place> message(int id, const std::string& robot) const;
  std::optional<stereo_descriptor_vo::PlaceSignature> signature(int id, const std::string& robot) const;
  /// Without header and counts of unused input.
  stereo_descriptor_vo::PlaceInfo info(const PlaceReport& report) const;
  /// Pose of the base in the map at the newest key frame; none while its covariance is unknown. The caller fills in
  /// frame and stamp.
  std::optional<geometry_msgs::PoseWithCovarianceStamped> basePose(const Eigen::Isometry3d& T_base_camera) const;

  /// Places that look like another robot's, best first. Throws std::invalid_argument if the words are of another kind.
  std::vector<PlaceCandidate> find(const stereo_descriptor_vo::PlaceSignature& signature) const;
  /// The geometric match of place `id` with another robot's; none where they are not the same place.
  std::optional<stereo_descriptor_vo::PlaceMatch> verify(int id, const Place& other) const;

  /// Whether one of the loaded places was recognised; true if none were loaded.
  bool isLocated() const { return located_; }
  /// Whether T_map_odom is known: located, or given on initialpose.
  bool isPlaced() const { return located_ || pose_given_; }
  /// Whether new places are added to a map in which the robot is located.
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
  bool clock_fell_ = false;  ///< and no stamp has fallen since
  bool continues_ = false;   ///< the motion from the last pair to the next one is known
  int loaded_ = 0;           ///< places with smaller ids were loaded
  bool located_ = true;
  bool pose_given_ = false;
  struct Expectation {
    Eigen::Isometry3d T_map_base;
    double radius;
  };
  std::optional<Expectation> expected_;
};

}  // namespace sdvo
