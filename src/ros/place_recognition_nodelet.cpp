#include <nav_msgs/Odometry.h>
#include <nodelet/nodelet.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>
#include <stereo_descriptor_vo/GetPlace.h>
#include <stereo_descriptor_vo/LoadPlaces.h>
#include <stereo_descriptor_vo/SavePlaces.h>
#include <stereo_descriptor_vo/StereoFeatures.h>
#include <stereo_descriptor_vo/VoInfo.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../config/interface_options.hpp"
#include "callback_thread.hpp"
#include "camera_mount.hpp"
#include "conversions.hpp"
#include "exact_synchroniser.hpp"
#include "other_robot.hpp"
#include "params.hpp"
#include "place_conversions.hpp"
#include "place_diagnostics.hpp"
#include "place_publisher.hpp"
#include "places_file.hpp"
#include "report_throttle.hpp"
#include "robot_transforms.hpp"
#include "stamps.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"
#include "worker.hpp"

namespace sdvo {

/// Stereo feature messages and their odometry in; a map of places, and where the odometry is in it, out. Never sees an
/// image.
class PlaceRecognitionNodelet : public nodelet::Nodelet {
 public:
  ~PlaceRecognitionNodelet() override {
    if (mount_) mount_->stop();
    // Nothing may arrive any more, and nothing be in work, when members go.
    callbacks_.stop();
    slow_callbacks_.stop();
    if (other_) other_->stop();
    if (observer_) observer_->stop();
    if (optimiser_) optimiser_->stop();
  }

 private:
  using Features = stereo_descriptor_vo::StereoFeatures;
  using Odometry = nav_msgs::Odometry;
  using Info = stereo_descriptor_vo::VoInfo;

  struct Options {
    PlaceOutputOptions output;
    PlaceRecognitionOptions recognition;

    void describe(OptionList& list) {
      output.describe(list);
      recognition.describe(list);
    }
  };

  struct Pair {
    Features::ConstPtr features;
    Odometry::ConstPtr odometry;
    Info::ConstPtr info;
  };

  /// Of the last pair observed.
  struct Last {
    ros::Time stamp, now, session;
    std::uint32_t epoch;
    StereoCamera camera;
    DescriptorKind kind;
  };

  /// All that begins anew together.
  struct Session {
    explicit Session(const PlaceRecognitionOptions& options) : recognition(options) {}

    PlaceRecognition recognition;
    std::string odom_frame;
    ros_conversions::FeatureStream stream;
    std::optional<Last> last;
    bool continues = false;  ///< the next pair's motion since the last one is known
    int loaded = 0;          ///< places with smaller ids were loaded
    bool located = true;     ///< one of these was recognised
    double optimise_time = 0.0;
  };

  struct Job {
    PoseGraph graph;
    std::shared_ptr<Session> session;
  };

  void onInit() override try {
    nh_ = callbacks_.serve(getNodeHandle());
    ros::NodeHandle private_nh = callbacks_.serve(getPrivateNodeHandle());
    ros::NodeHandle slow_nh = slow_callbacks_.serve(getPrivateNodeHandle());
    for (const std::string& name : loadParams(private_nh, options_))
      NODELET_WARN_STREAM("parameter " << name << " is unknown and has no effect");
    const PlaceOutputOptions& output = options_.output;
    robot_ = output.robot_name.empty() ? nh_.getNamespace() : output.robot_name;
    session_ = std::make_shared<Session>(options_.recognition);
    if (!output.places_file.empty()) begin();

    transforms_ = std::make_unique<RobotTransforms>(nh_, std::nullopt, [this](const std::string& what) {
      if (throttle_.allows(what)) NODELET_WARN_STREAM(what);
    });
    mount_ = std::make_unique<CameraMount>(*transforms_, output.tf_timeout);
    publisher_ = std::make_unique<PlacePublisher>(nh_, output, robot_, [this] { return map(); });
    diagnostics_ = std::make_unique<PlaceDiagnostics>(nh_, private_nh, getName(), inputs(), output.max_silence);
    services_ = {private_nh.advertiseService("reset", &PlaceRecognitionNodelet::onReset, this),
                 private_nh.advertiseService("pause", &PlaceRecognitionNodelet::onPause, this),
                 private_nh.advertiseService("resume", &PlaceRecognitionNodelet::onResume, this),
                 slow_nh.advertiseService("save_places", &PlaceRecognitionNodelet::onSavePlaces, this),
                 slow_nh.advertiseService("load_places", &PlaceRecognitionNodelet::onLoadPlaces, this),
                 slow_nh.advertiseService("get_place", &PlaceRecognitionNodelet::onGetPlace, this)};
    observer_ = std::make_unique<Worker<Pair>>(static_cast<std::size_t>(output.queue_size),
                                               [this](const Pair& pair) { observe(pair); });
    optimiser_ = std::make_unique<Worker<Job>>(1, [this](const Job& job) { optimise(job); });
    other_ = std::make_unique<OtherRobot>(nh_, robot_, output.other_min_score, output.other_timeout, placesForOthers());
    subscribe();
    callbacks_.start();
    slow_callbacks_.start();
  } catch (const std::exception& e) {
    NODELET_FATAL_STREAM("not started: " << e.what());
    throw;  // the manager forgets the nodelet, and its loader ends with an error
  }

  /// With the places of the parameter's file. On a robot's first day there is none.
  void begin() {
    const std::string& path = options_.output.places_file;
    if (!std::filesystem::exists(path)) {
      NODELET_WARN_STREAM("places_file '" << path << "' does not exist: begins without places");
      return;
    }
    session_ = load(path);
    NODELET_INFO_STREAM(session_->recognition.places().size() << " places of '" << path << "'");
  }

  std::string inputs() const {
    return nh_.resolveName("stereo_features") + ", " + nh_.resolveName("odom") + " and " + nh_.resolveName("vo_info");
  }

  // Input, in the callbacks' thread.

  void subscribe() {
    const int room = options_.output.sync_queue_size;
    synchroniser_ = std::make_unique<ExactSynchroniser<Features, Odometry, Info>>(
        room, [this](const auto&... messages) { onPair(messages...); },
        [this](const auto&... messages) { onUnpaired(messages...); });
    const auto queue = static_cast<std::uint32_t>(room);
    subscribers_ = {
        nh_.subscribe<Features>("stereo_features", queue, [this](const Features::ConstPtr& m) { take<0>(m); }),
        nh_.subscribe<Odometry>("odom", queue, [this](const Odometry::ConstPtr& m) { take<1>(m); }),
        nh_.subscribe<Info>("vo_info", queue, [this](const Info::ConstPtr& m) { take<2>(m); })};
  }

  template <int input, class Message>
  void take(const boost::shared_ptr<const Message>& message) try {
    synchroniser_->add<input>(message);
  } catch (const std::exception& e) {
    ++malformed_;
    if (throttle_.allows(e.what()))
      NODELET_ERROR_STREAM("message at " << message->header.stamp << " skipped: " << e.what());
  }

  void onPair(const Features::ConstPtr& features, const Odometry::ConstPtr& odometry, const Info::ConstPtr& info) {
    diagnostics_->notePair();
    if (options_.output.publish_tf)
      transforms_->claim({ros_conversions::cleanFrameId(options_.output.map_frame_id),
                          ros_conversions::cleanFrameId(odometry->header.frame_id)});
    observer_->push({features, odometry, info});
  }

  void onUnpaired(const Features::ConstPtr&, const Odometry::ConstPtr& odometry, const Info::ConstPtr& info) {
    const bool has_odometry = !info || (info->state != "LOST" && info->state != "WAITING");
    if (odometry || has_odometry) ++unpaired_;
  }

  // Recognition, in the observer's thread.

  void observe(const Pair& pair) try {
    const ros::Time stamp = pair.features->header.stamp;
    const std::optional<Eigen::Isometry3d> T_base_camera = findExtrinsic(pair);
    if (!T_base_camera) return;
    const StereoFeatures features = ros_conversions::fromMessage(*pair.features);
    const Eigen::Isometry3d T_odom_camera = ros_conversions::toPose(pair.odometry->pose.pose) * *T_base_camera;

    const std::lock_guard<std::mutex> lock(mutex_);
    const ros::Time now = ros::Time::now();
    if (session_->last && stamp < session_->last->stamp) {
      if (!ros::Time::isSimTime() && now < session_->last->now)
        session_->continues = false;  // the system's clock was set back: the places are where they were
      else
        restart("the clock jumped back");
    }
    Session& session = *session_;
    if (session.last && stamp == session.last->stamp) return;
    refuseOtherCamera(session, features.camera, features.kind());
    const CameraMotion motion = motionOf(pair, T_odom_camera, *T_base_camera);
    const std::optional<PlaceReport> report = session.recognition.observe(features, motion);
    session.last = {stamp, now, pair.info->session, pair.info->epoch, features.camera, features.kind()};
    session.continues = true;
    session.odom_frame = ros_conversions::cleanFrameId(pair.odometry->header.frame_id);
    session.stream = ros_conversions::streamOf(*pair.features);
    if (report) publish(*report, stamp);
  } catch (const std::exception& e) {
    ++malformed_;
    if (throttle_.allows(e.what()))
      NODELET_ERROR_STREAM("pair at " << pair.features->header.stamp << " skipped: " << e.what());
  }

  std::optional<Eigen::Isometry3d> findExtrinsic(const Pair& pair) {
    const std::string base_frame = ros_conversions::cleanFrameId(pair.odometry->child_frame_id);
    const std::string camera_frame = ros_conversions::cleanFrameId(pair.features->header.frame_id);
    std::string problem;
    const std::optional<Eigen::Isometry3d> found = mount_->find(base_frame, camera_frame, problem);
    if (!found && throttle_.allows("extrinsic"))
      NODELET_ERROR_STREAM("no transform from camera frame '" << camera_frame << "' to base frame '" << base_frame
                                                              << "' on TF, no places without it: publish it (static). "
                                                              << problem);
    return found;
  }

  /// Under the lock, as what follows.
  static void refuseOtherCamera(const Session& session, const StereoCamera& camera, const DescriptorKind& kind) {
    const std::map<int, Place>& places = session.recognition.places();
    if (places.empty()) return;
    const StereoFeatures& known = places.begin()->second.features;
    if (camera != known.camera)
      throw std::invalid_argument(
          "the places are of another camera, or of another calibration of this one: call reset, or load_places of "
          "this");
    if (kind != known.kind())
      throw std::invalid_argument("the places are described by " + toString(known.kind()) + ", not by " +
                                  toString(kind) + ": call reset, or load_places of these");
  }

  CameraMotion motionOf(const Pair& pair, const Eigen::Isometry3d& T_odom_camera,
                        const Eigen::Isometry3d& T_base_camera) const {
    CameraMotion motion;
    motion.T_odom_camera = T_odom_camera;
    const std::optional<Last>& last = session_->last;
    motion.continuous =
        session_->continues && last && pair.info->session == last->session && pair.info->epoch == last->epoch;
    if (motion.continuous)
      motion.covariance = ros_conversions::toMotionCovariance(
          *pair.odometry, secondsBetween(last->stamp, pair.features->header.stamp), T_base_camera);
    return motion;
  }

  void publish(const PlaceReport& report, const ros::Time& stamp) {
    Session& session = *session_;
    const PlaceRecognition& recognition = session.recognition;
    const bool was_located = session.located;
    if (report.loop) {
      session.located |= *report.same < session.loaded;
      NODELET_INFO_STREAM("key frame " << report.id << " shows the place of key frame " << *report.same << ": a loop");
      optimiser_->push({recognition.graph(), session_});
    }
    if (session.located) publisher_->correct(recognition.T_map_odom(), session.odom_frame, !was_located);
    publisher_->noteChange();

    const auto place = recognition.places().find(report.id);
    if (place != recognition.places().end())
      publisher_->publish(ros_conversions::toMessage(recognition.signature(report.id), place->second,
                                                     options_.recognition.index, robot_, session.stream.frame_id));
    stereo_descriptor_vo::PlaceInfo info = ros_conversions::toInfo(report);
    info.header.stamp = stamp;
    info.header.frame_id = ros_conversions::cleanFrameId(options_.output.map_frame_id);
    info.optimise_time = static_cast<float>(session.optimise_time);
    info.located = session.located;
    info.places = static_cast<std::uint32_t>(recognition.places().size());
    info.loops = static_cast<std::uint32_t>(recognition.graph().loops());
    info.bytes = recognition.bytes();
    info.turn_error = static_cast<float>(recognition.graph().turnError());
    info.map_to_odom = tf2::eigenToTransform(recognition.T_map_odom()).transform;
    info.dropped_pairs = observer_->dropped();
    info.unpaired = unpaired_;
    info.malformed = malformed_;
    publisher_->publish(info);
    diagnostics_->note(info);
  }

  void restart(const char* why) {
    NODELET_WARN_STREAM(why << ": " << session_->recognition.places().size() << " places are forgotten");
    replace(std::make_shared<Session>(options_.recognition));
  }

  void replace(std::shared_ptr<Session> session) {
    session_ = std::move(session);
    publisher_->forget();
    diagnostics_->restart();
  }

  /// In the optimiser's thread, which works on a copy while the graph grows.
  void optimise(const Job& job) try {
    PoseGraph graph = job.graph;
    const PoseGraph::Summary summary = graph.optimise();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (job.session != session_) return;
    Session& session = *session_;
    session.optimise_time = summary.time;
    if (!session.recognition.adopt(graph)) {
      optimiser_->push({session.recognition.graph(), session_});
      return;
    }
    if (session.located) publisher_->correct(session.recognition.T_map_odom(), session.odom_frame, false);
    publisher_->noteChange();
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM("the map was not optimised: " << e.what());
  }

  /// For the publisher.
  std::optional<PlacePublisher::Map> map() {
    const std::optional<Eigen::Isometry3d> T_base_camera = mount_->last();
    if (!T_base_camera) return std::nullopt;
    const std::lock_guard<std::mutex> lock(mutex_);
    return PlacePublisher::Map{mapState(), *T_base_camera};
  }

  /// Under the lock.
  ros_conversions::MapState mapState() const {
    ros_conversions::MapState state{session_->recognition.graph(), {}};
    for (const auto& [id, place] : session_->recognition.places()) state.stamps[id] = place.features.stamp;
    return state;
  }

  // The other robot, in its thread.

  OtherRobot::Places placesForOthers() {
    OtherRobot::Places places;
    places.find = [this](const OtherRobot::SignatureMessage& signature) {
      const std::lock_guard<std::mutex> lock(mutex_);
      const PlaceRecognition& recognition = session_->recognition;
      if (recognition.places().empty()) return std::vector<PlaceCandidate>();
      return recognition.find(ros_conversions::fromMessage(signature, options_.recognition.index,
                                                           recognition.places().begin()->second.features.kind()));
    };
    places.verify = [this](int id, const Place& other) -> std::optional<stereo_descriptor_vo::PlaceMatch> {
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto mine = session_->recognition.places().find(id);
      if (mine == session_->recognition.places().end()) return std::nullopt;
      const PlaceMatch match = session_->recognition.verify(id, other.features);
      if (!match.same) return std::nullopt;
      return ros_conversions::toMessage(match, mine->second, other, session_->stream.frame_id);
    };
    places.publish = [this](const stereo_descriptor_vo::PlaceMatch& match) { publisher_->publish(match); };
    places.warn = [this](const std::string& what) { NODELET_WARN_STREAM(what); };
    return places;
  }

  // The services.

  bool onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    const std::lock_guard<std::mutex> lock(mutex_);
    restart("reset was called");
    return true;
  }

  /// A paused nodelet subscribes to nothing: the image side has one listener less.
  bool onPause(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    response.success = true;
    response.message = subscribers_.empty() ? "was paused already" : "paused";
    subscribers_.clear();
    diagnostics_->notePaused(true);
    return true;
  }

  bool onResume(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    response.success = true;
    response.message = subscribers_.empty() ? "resumed; the way in between is unknown" : "was not paused";
    if (!subscribers_.empty()) return true;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      session_->continues = false;
    }
    diagnostics_->notePaused(false);
    subscribe();
    return true;
  }

  bool onSavePlaces(stereo_descriptor_vo::SavePlaces::Request& request,
                    stereo_descriptor_vo::SavePlaces::Response& response) try {
    std::vector<Place> places;
    std::unique_lock<std::mutex> lock(mutex_);
    for (const auto& [id, place] : session_->recognition.places()) places.push_back(place);
    const ros_conversions::MapState state = mapState();
    const ros_conversions::FeatureStream stream = session_->stream;
    lock.unlock();
    if (places.empty()) throw std::runtime_error("there is no place yet");
    savePlaces(places, state, stream, robot_, ros_conversions::cleanFrameId(options_.output.map_frame_id),
               request.path);
    response.success = true;
    response.message = std::to_string(places.size()) + " places";
    return true;
  } catch (const std::exception& e) {
    response.message = e.what();
    return true;
  }

  bool onLoadPlaces(stereo_descriptor_vo::LoadPlaces::Request& request,
                    stereo_descriptor_vo::LoadPlaces::Response& response) try {
    std::shared_ptr<Session> loaded = load(request.path);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (session_->last) refuseOtherCamera(*loaded, session_->last->camera, session_->last->kind);
    response.message = std::to_string(loaded->recognition.places().size()) + " places; " +
                       std::to_string(session_->recognition.places().size()) + " of before are forgotten";
    replace(std::move(loaded));
    response.success = true;
    return true;
  } catch (const std::exception& e) {
    response.message = e.what();
    return true;
  }

  /// A session that begins with the places of a file. Throws std::runtime_error or std::invalid_argument.
  std::shared_ptr<Session> load(const std::string& path) const {
    SavedPlaces saved = loadPlaces(path, options_.recognition.graph);
    auto session = std::make_shared<Session>(options_.recognition);
    session->stream = saved.stream;
    session->recognition.restore(std::move(saved.places), saved.graph);
    session->loaded = session->recognition.places().rbegin()->first + 1;
    session->located = false;
    return session;
  }

  bool onGetPlace(stereo_descriptor_vo::GetPlace::Request& request,
                  stereo_descriptor_vo::GetPlace::Response& response) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::map<int, Place>& places = session_->recognition.places();
    const auto place = places.find(static_cast<int>(request.id));
    if (place == places.end()) {
      response.message = "there is no place " + std::to_string(request.id);
      return true;
    }
    response.place = ros_conversions::toMessage(place->second, robot_, session_->stream);
    response.success = true;
    return true;
  }

  CallbackThread callbacks_, slow_callbacks_;  // the second one of services that take their time
  ros::NodeHandle nh_;
  Options options_;
  std::string robot_;
  ReportThrottle throttle_;
  std::unique_ptr<RobotTransforms> transforms_;
  std::unique_ptr<CameraMount> mount_;
  std::unique_ptr<PlacePublisher> publisher_;
  std::unique_ptr<PlaceDiagnostics> diagnostics_;
  std::vector<ros::ServiceServer> services_;

  std::atomic<std::uint64_t> unpaired_{0}, malformed_{0};

  std::mutex mutex_;
  std::shared_ptr<Session> session_;  // and all in it: under mutex_

  std::unique_ptr<Worker<Pair>> observer_;
  std::unique_ptr<Worker<Job>> optimiser_;
  std::unique_ptr<OtherRobot> other_;

  // Only the callbacks' thread touches these.
  std::unique_ptr<ExactSynchroniser<Features, Odometry, Info>> synchroniser_;
  std::vector<ros::Subscriber> subscribers_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::PlaceRecognitionNodelet, nodelet::Nodelet)
