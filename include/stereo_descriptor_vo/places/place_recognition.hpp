#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/places/place.hpp"
#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace sdvo {

struct PlaceRecognitionOptions {
  double keyframe_distance = 3.0;
  int max_features = 500;  ///< kept of a key frame (chosen)
  int max_places = 10000;
  double min_age = 20.0;     ///< s: younger key frames are no candidates, unless there was a break since (chosen)
  double min_travel = 30.0;  ///< m: … nor those from which the path here is shorter (chosen)
  int candidates = 1;        ///< places that geometry looks at for each key frame (chosen)
  bool localisation_only = false;

  void describe(OptionList& list) {
    list.add("keyframe_distance", keyframe_distance, {0.01, 100.0}, "m",
             "a pair is kept as a key frame after so long a way, or a turn of 15 degrees");
    list.add("max_places", max_places, {10, 1000000}, "", "key frames kept; the oldest goes");
    list.add("localisation_only", localisation_only,
             "a map that was loaded stays as it is: no places are added, none is moved");
  }
};

/// The odometry's output for a pair.
struct CameraMotion {
  Eigen::Isometry3d T_odom_camera = Eigen::Isometry3d::Identity();
  Matrix6d covariance =
      Matrix6d::Zero();    ///< of the motion since the pair before: of its right perturbation, m and rad
  bool continuous = true;  ///< false: the motion since the pair before is unknown (a new epoch)
  double readout = 0.0;    ///< s, of rolling shutters: by it and the velocity, rows are moved to the stamp
  Vector6d velocity = Vector6d::Zero();  ///< in the camera's frame, m/s and rad/s
};

/// Result for a new key frame.
struct PlaceReport {
  int id = 0;                                 ///< of the new key frame
  std::vector<PlaceCandidate> candidates;     ///< places of similar appearance
  std::optional<int> same;                    ///< the place that geometry confirmed
  PlaceMatch match;                           ///< of this place; of the last candidate, where none was confirmed
  bool loop = false;                          ///< accepted: the graph has a new loop and is to be optimised
  std::string reason;                         ///< why there is no loop
  double find_time = 0.0, verify_time = 0.0;  ///< s
};

/// Recognises places by the features of stereo pairs, without images, and keeps a graph of their poses. Where the
/// camera comes back to a place, the drift of the odometry is corrected.
class PlaceRecognition {
 public:
  /// Throws std::invalid_argument when an option is out of its range.
  explicit PlaceRecognition(const PlaceRecognitionOptions& options);
  PlaceRecognition(PlaceRecognition&&) noexcept;
  ~PlaceRecognition();

  /// Takes the next pair of the odometry. Returns a report if it became a key frame. The graph is not optimised here:
  /// that takes long and may be done on a copy meanwhile (graph(), PoseGraph::optimise(), adopt()). Throws
  /// std::invalid_argument, and adds no place, for descriptors that are not binary or of another kind than those
  /// before. The caller ensures that the camera is the same.
  std::optional<PlaceReport> observe(const StereoFeatures& features, const CameraMotion& motion);

  const PoseGraph& graph() const { return graph_; }
  bool adopt(const PoseGraph& optimised) { return graph_.adopt(optimised); }

  /// Pose of the odometry's origin in the map, by the last key frame.
  Eigen::Isometry3d T_map_odom() const;

  /// Covariance of T_map_odom(), as that of a right perturbation of the last key frame in the map: it grows along the
  /// path since the place that was recognised last. If that place is forgotten, since the first one that is kept. None
  /// if there is a break on every path.
  std::optional<Matrix6d> covariance() const;

  /// A hint of the odometry's pose in the map. The next key frame is put there, after a break. Until a place is
  /// recognised, only places within `radius` (m) of the camera are candidates. Without places nothing happens.
  void expect(const Eigen::Isometry3d& T_map_odom, double radius);

  /// All places by id.
  const std::map<int, Place>& places() const { return places_; }
  PlaceSignature signature(int place) const;
  std::size_t bytes() const;  ///< of all places and their words

  /// Places that look like another robot's, the best first.
  std::vector<PlaceCandidate> find(const PlaceSignature& signature) const;
  /// Whether another robot's features show a place.
  PlaceMatch verify(int place, const StereoFeatures& features) const;

  /// Loads the places and the graph of an earlier session, before the first pair of this one. They stay where they are.
  /// The pose of the present session in their map is unknown until a place is recognised. Throws std::invalid_argument
  /// when there are places already, or when places and graph do not belong together.
  void restore(std::vector<Place> places, const PoseGraph& graph);

 private:
  bool isKeyframe(const StereoFeatures& features) const;
  void addKeyframe(const StereoFeatures& features, int id);
  void recognise(const Place& here, PlaceReport& report);
  bool isPossible(const GraphEdge& loop) const;
  bool isCandidate(const Place& place, const Place& here) const;
  void forgetOldest();
  void forget(int id);

  PlaceRecognitionOptions options_;
  struct Tools;
  std::unique_ptr<Tools> tools_;
  PoseGraph graph_;
  std::map<int, Place> places_;
  std::optional<int> last_;        ///< key frame of this session
  std::optional<int> recognised_;  ///< the place of the last loop
  int restored_ = 0;               ///< places with smaller ids were loaded
  struct Expectation {
    Eigen::Isometry3d T_map_odom;
    double radius;  ///< m
  };
  std::optional<Expectation> expectation_;
  int next_id_ = 0;
  int segment_ = 0;

  /// The path since the last key frame.
  struct Way {
    std::optional<Eigen::Isometry3d> T_odom_camera;  ///< of the last pair
    Matrix6d covariance = Matrix6d::Zero();          ///< of a right perturbation of its end
    double length = 0.0;                             ///< m
    double turn = 0.0;                               ///< rad
    bool known = true;
  };
  Way way_;
  double travelled_ = 0.0;  ///< m
};

}  // namespace sdvo
