#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <stereo_descriptor_vo/PlaceInfo.h>
#include <tf2_eigen/tf2_eigen.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../../common/text.hpp"
#include "../../messages/feature_conversions.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/odometry_conversions.hpp"
#include "../../messages/place_conversions.hpp"
#include "../../messages/pose_conversions.hpp"
#include "../../messages/stamps.hpp"
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
  PlaceSession(const PlaceRecognitionOptions& options, SavedPlaces saved)
      : localises_only_(options.localisation_only), recognition_(options), stream_(saved.stream), located_(false) {
    recognition_.restore(std::move(saved.places), saved.graph);
    loaded_ = recognition_.places().rbegin()->first + 1;
  }

  /// How a pair's stamp follows the last one. Stamps that fall with simulated time begin anew (a bag is played again).
  /// Otherwise a driver restarted or the system's clock was set back: only the motion in between is unknown.
  enum class Time { kGoesOn, kStands, kFell, kBeganAnew };
  Time noteTime(const ros::Time& stamp, const ros::Time& now, bool is_simulated) {
    clock_fell_ |= last_now_ && now < *last_now_;
    last_now_ = now;
    if (last_ && stamp == last_->stamp) return Time::kStands;
    const bool falls = last_ && stamp < last_->stamp;
    // A pair that waited while the clock jumped back still has a stamp of the earlier time, ahead of the clock.
    const bool is_of_new_time = falls || stamp <= now + ros::Duration(1.0);
    if (!last_ || !(falls || (clock_fell_ && is_simulated && is_of_new_time))) return Time::kGoesOn;
    continues_ = false;
    return std::exchange(clock_fell_, false) && is_simulated ? Time::kBeganAnew : Time::kFell;
  }

  /// Takes the next pair. Returns a report if it became a key frame. Throws std::invalid_argument for another camera or
  /// other descriptors than those of the places, and for inconsistent messages.
  std::optional<PlaceReport> observe(const OdometryPair& pair, const Eigen::Isometry3d& T_base_camera) {
    const StereoFeatures features = ros_conversions::fromMessage(*pair.features);
    const auto kind = features.count() > 0 ? std::optional(features.kind()) : kind_;
    refuse(features.camera, kind);
    kind_ = kind;
    const ros::Time stamp = pair.features->header.stamp;
    const Eigen::Isometry3d T_odom_base = ros_conversions::toPose(pair.odometry->pose.pose);
    if (const auto expected = std::exchange(expected_, std::nullopt); expected && !recognition_.places().empty()) {
      recognition_.expect(expected->T_map_base * T_odom_base.inverse(), expected->radius);
      located_ = false;
      pose_given_ = true;
    }
    CameraMotion motion;
    motion.T_odom_camera = T_odom_base * T_base_camera;
    motion.continuous = continues_ && last_ && pair.info->session == last_->session &&
                        pair.info->epoch == last_->epoch && pair.resumes == last_->resumes;
    motion.readout = pair.info->used_readout;
    if (motion.continuous) {
      const double dt = secondsBetween(last_->stamp, stamp);
      motion.covariance = ros_conversions::toMotionCovariance(*pair.odometry, dt, T_base_camera);
      motion.velocity = logSE3((last_->T_odom_base * T_base_camera).inverse() * motion.T_odom_camera) / dt;
    }
    std::optional<PlaceReport> report = recognition_.observe(features, motion);
    last_ = {stamp, pair.info->session, pair.info->epoch, pair.resumes, features.camera, T_odom_base};
    continues_ = true;
    odom_frame_ = ros_conversions::cleanFrameId(pair.odometry->header.frame_id);
    stream_ = ros_conversions::streamOf(*pair.features);
    if (report && report->loop) located_ |= loaded_ == 0 || *report->same < loaded_;
    return report;
  }

  /// Takes a pose of the base in the map, such as rviz' "2D Pose Estimate". It holds from the next pair on, and until a
  /// place is recognised only places nearby are compared. Returns the effect in words. Throws std::invalid_argument for
  /// a pose in another frame than `map_frame`, and for numbers that are not finite.
  std::string expect(const geometry_msgs::PoseWithCovarianceStamped& pose, const std::string& map_frame) {
    constexpr double kLeast = 5.0;   // m: a click in rviz is no better (chosen)
    constexpr double kSigmas = 3.0;  // standard deviations
    const std::string frame = ros_conversions::cleanFrameId(pose.header.frame_id);
    if (frame != map_frame)
      throw std::invalid_argument("it is in frame '" + frame + "'; publish it in the map's, '" + map_frame +
                                  "' (rviz: Fixed Frame)");
    const double variance = std::max(pose.pose.covariance[0], pose.pose.covariance[7]);
    if (!std::isfinite(variance)) throw std::invalid_argument("its covariance is not finite");
    const Eigen::Isometry3d T_map_base = ros_conversions::toPose(pose.pose.pose);
    expected_ = {T_map_base, kLeast + kSigmas * std::sqrt(std::max(0.0, variance))};
    if (!last_ || !isPlaced()) return "the robot is placed in the map";
    const Eigen::Isometry3d moved = (recognition_.T_map_odom() * last_->T_odom_base).inverse() * T_map_base;
    return text(2, "the robot is moved in the map, by ", moved.translation().norm(), " m and ",
                180.0 / M_PI * Eigen::AngleAxisd(moved.linear()).angle(), " deg");
  }

  /// Throws std::invalid_argument if camera or descriptors of the places differ from the last ones of `session`.
  void refuseOtherCameraThan(const PlaceSession& session) const {
    if (session.last_) refuse(session.last_->camera, session.kind_);
  }

  PlaceRecognition& recognition() { return recognition_; }
  const PlaceRecognition& recognition() const { return recognition_; }
  ros_conversions::MapState map() const {
    ros_conversions::MapState state{recognition_.graph(), {}};
    for (const auto& [id, place] : recognition_.places()) state.stamps[id] = place.features.stamp;
    return state;
  }
  SavedPlaces saved() const {
    SavedPlaces saved{{}, recognition_.graph(), stream_};
    for (const auto& [id, place] : recognition_.places()) saved.places.push_back(place);
    return saved;
  }
  const std::string& odomFrame() const { return odom_frame_; }
  std::optional<stereo_descriptor_vo::Place> message(int id, const std::string& robot) const {
    const auto place = recognition_.places().find(id);
    if (place == recognition_.places().end()) return std::nullopt;
    return ros_conversions::toMessage(place->second, robot, stream_);
  }
  std::optional<stereo_descriptor_vo::PlaceSignature> signature(int id, const std::string& robot) const {
    const auto place = recognition_.places().find(id);
    if (place == recognition_.places().end()) return std::nullopt;
    return ros_conversions::toMessage(recognition_.signature(id), place->second, robot, stream_.frame_id);
  }
  /// Without header and counts of unused input.
  stereo_descriptor_vo::PlaceInfo info(const PlaceReport& report) const {
    stereo_descriptor_vo::PlaceInfo info = ros_conversions::toInfo(report);
    info.optimise_time = static_cast<float>(optimise_time);
    info.located = located_;
    info.places = static_cast<std::uint32_t>(recognition_.places().size());
    info.loops = static_cast<std::uint32_t>(recognition_.graph().loops());
    info.bytes = recognition_.bytes();
    info.turn_error = static_cast<float>(recognition_.graph().turnError());
    info.map_to_odom = tf2::eigenToTransform(recognition_.T_map_odom()).transform;
    return info;
  }
  /// Pose of the base in the map at the newest key frame; none while its covariance is unknown. The caller fills in
  /// frame and stamp.
  std::optional<geometry_msgs::PoseWithCovarianceStamped> basePose(const Eigen::Isometry3d& T_base_camera) const {
    const std::optional<Matrix6d> of_camera = recognition_.covariance();
    if (!of_camera) return std::nullopt;
    const Eigen::Isometry3d T_map_base = recognition_.graph().nodes().rbegin()->second * T_base_camera.inverse();
    const Matrix6d to_base = adjoint(T_base_camera);
    geometry_msgs::PoseWithCovarianceStamped pose;
    pose.pose = ros_conversions::toMessage(T_map_base, to_base * *of_camera * to_base.transpose());
    return pose;
  }

  /// Places that look like another robot's, best first. Throws std::invalid_argument if the words are of another kind.
  std::vector<PlaceCandidate> find(const stereo_descriptor_vo::PlaceSignature& signature) const {
    if (recognition_.places().empty()) return {};
    const DescriptorKind kind = recognition_.places().begin()->second.features.kind();
    return recognition_.find(ros_conversions::fromMessage(signature, kind));
  }
  /// The geometric match of place `id` with another robot's; none where they are not the same place.
  std::optional<stereo_descriptor_vo::PlaceMatch> verify(int id, const Place& other) const {
    const auto mine = recognition_.places().find(id);
    if (mine == recognition_.places().end()) return std::nullopt;
    const PlaceMatch match = recognition_.verify(id, other.features);
    if (!match.same) return std::nullopt;
    return ros_conversions::toMessage(match, mine->second, other, stream_.frame_id);
  }

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

  void refuse(const StereoCamera& camera, const std::optional<DescriptorKind>& kind) const {
    if (recognition_.places().empty()) return;
    const StereoFeatures& known = recognition_.places().begin()->second.features;
    if (!known.camera.isLike(camera))
      throw std::invalid_argument("the places are of another camera: load_places of this one, or reset without any");
    if (kind && *kind != known.kind())
      throw std::invalid_argument("the places are described by " + toString(known.kind()) + ", not by " +
                                  toString(*kind) + ": load_places of these, or reset without any");
  }

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

/// The session of a nodelet, which services replace.
struct SharedSession {
  std::mutex mutex;
  std::shared_ptr<PlaceSession> session;  ///< it and all in it: under the mutex
};

}  // namespace sdvo
