#include <geometry_msgs/PoseWithCovarianceStamped.h>
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
#include <cmath>
#include <filesystem>
#include <memory>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../config/interface_options.hpp"
#include "callback_thread.hpp"
#include "camera_mount.hpp"
#include "exact_synchroniser.hpp"
#include "frame_id.hpp"
#include "other_robot.hpp"
#include "params.hpp"
#include "place_conversions.hpp"
#include "place_diagnostics.hpp"
#include "place_publisher.hpp"
#include "place_session.hpp"
#include "places_file.hpp"
#include "pose_conversions.hpp"
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

  /// A pair of the session that was there when it arrived.
  struct Arrived {
    OdometryPair pair;
    int generation;
  };

  struct Job {
    PoseGraph graph;
    std::shared_ptr<PlaceSession> session;
  };

  void onInit() override try {
    nh_ = callbacks_.serve(getNodeHandle());
    ros::NodeHandle private_nh = callbacks_.serve(getPrivateNodeHandle());
    ros::NodeHandle slow_nh = slow_callbacks_.serve(getPrivateNodeHandle());
    ros::NodeHandle other_nh = slow_callbacks_.serve(getNodeHandle());
    for (const std::string& name : loadParams(private_nh, options_))
      NODELET_WARN_STREAM("parameter " << name << " is unknown and has no effect");
    const PlaceOutputOptions& output = options_.output;
    if (output.opencv_threads >= 0) cv::setNumThreads(output.opencv_threads);
    robot_ = output.robot_name.empty() ? nh_.getNamespace() : output.robot_name;
    session_ = std::make_shared<PlaceSession>(options_.recognition);
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
    observer_ = std::make_unique<Worker<Arrived>>(static_cast<std::size_t>(output.queue_size),
                                                  [this](const Arrived& arrived) { observe(arrived); });
    optimiser_ = std::make_unique<Worker<Job>>(1, [this](const Job& job) { optimise(job); });
    other_ =
        std::make_unique<OtherRobot>(other_nh, robot_, output.other_min_score, output.other_timeout, placesForOthers());
    subscribe();
    initial_pose_subscriber_ = nh_.subscribe<geometry_msgs::PoseWithCovarianceStamped>(
        "/initialpose", 1, [this](const geometry_msgs::PoseWithCovarianceStamped::ConstPtr& m) { onInitialPose(*m); });
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
    NODELET_INFO_STREAM(session_->recognition().places().size() << " places of '" << path << "'");
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
    subscribers_ = {subscribe<0, Features>("stereo_features"), subscribe<1, Odometry>("odom"),
                    subscribe<2, Info>("vo_info")};
  }

  /// A pose of the base in the map, such as rviz' "2D Pose Estimate".
  void onInitialPose(const geometry_msgs::PoseWithCovarianceStamped& message) try {
    constexpr double kLeast = 5.0, kSigmas = 3.0;  // m
    const std::string frame = ros_conversions::cleanFrameId(message.header.frame_id);
    const std::string map_frame = ros_conversions::cleanFrameId(options_.output.map_frame_id);
    if (frame != map_frame)
      throw std::invalid_argument("it is in frame '" + frame + "', not in the map's, '" + map_frame + "'");
    const double variance = std::max(message.pose.covariance[0], message.pose.covariance[7]);
    if (!std::isfinite(variance)) throw std::invalid_argument("its covariance is not finite");
    const Eigen::Isometry3d T_map_base = ros_conversions::toPose(message.pose.pose);
    const std::lock_guard<std::mutex> lock(mutex_);
    session_->expect(T_map_base, kLeast + kSigmas * std::sqrt(std::max(0.0, variance)));
  } catch (const std::exception& e) {
    NODELET_WARN_STREAM("the pose on " << initial_pose_subscriber_.getTopic() << " is not used: " << e.what());
  }

  template <int input, class Message>
  ros::Subscriber subscribe(const std::string& topic) {
    return nh_.subscribe<Message>(
        topic, static_cast<std::uint32_t>(options_.output.sync_queue_size),
        [this](const boost::shared_ptr<const Message>& m) { take<input>(m); }, ros::VoidConstPtr(),
        ros::TransportHints().tcpNoDelay());
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
    diagnostics_->input().note();
    if (options_.output.publish_tf)
      transforms_->claim({ros_conversions::cleanFrameId(options_.output.map_frame_id),
                          ros_conversions::cleanFrameId(odometry->header.frame_id)});
    observer_->push({{features, odometry, info, resumes_}, generation_});
  }

  void onUnpaired(const Features::ConstPtr&, const Odometry::ConstPtr& odometry, const Info::ConstPtr& info) {
    const bool has_odometry = !info || (info->state != "LOST" && info->state != "WAITING");
    if (odometry || has_odometry) ++unpaired_;
  }

  // Recognition, in the observer's thread.

  void observe(const Arrived& arrived) try {
    const OdometryPair& pair = arrived.pair;
    const ros::Time stamp = pair.features->header.stamp;
    const std::optional<Eigen::Isometry3d> T_base_camera = findExtrinsic(pair);
    if (!T_base_camera) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (arrived.generation != generation_) return;
    const PlaceSession::Time time = session_->noteTime(stamp, ros::Time::now(), ros::Time::isSimTime());
    if (time == PlaceSession::Time::kStands) return;
    if (time == PlaceSession::Time::kBeganAnew) restart("the clock jumped back");
    if (time == PlaceSession::Time::kFell)
      NODELET_WARN_STREAM("stamps fell to " << stamp << ": the places stay, the way in between is unknown");
    if (const std::optional<PlaceReport> report = session_->observe(pair, *T_base_camera)) publish(*report, stamp);
  } catch (const std::exception& e) {
    ++malformed_;
    if (throttle_.allows(e.what()))
      NODELET_ERROR_STREAM("pair at " << arrived.pair.features->header.stamp << " skipped: " << e.what());
  }

  std::optional<Eigen::Isometry3d> findExtrinsic(const OdometryPair& pair) {
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

  /// Under the lock, as what follows. `report`: of the session's newest key frame.
  void publish(const PlaceReport& report, const ros::Time& stamp) {
    const PlaceSession& session = *session_;
    const PlaceRecognition& recognition = session.recognition();
    if (report.loop) {
      NODELET_INFO_STREAM("key frame " << report.id << " shows the place of key frame " << *report.same << ": a loop");
      optimiser_->push({recognition.graph(), session_});
    }
    if (session.isPlaced())
      publisher_->correct(recognition.T_map_odom(), session.odomFrame(), !was_located_ || !session.isLocated());
    was_located_ = session.isLocated();
    if (was_located_) publishPose(stamp);
    publisher_->noteChange();

    const auto place = recognition.places().find(report.id);
    if (place != recognition.places().end())
      publisher_->publish(ros_conversions::toMessage(recognition.signature(report.id), place->second,
                                                     options_.recognition.index, robot_, session.stream().frame_id));
    stereo_descriptor_vo::PlaceInfo info = ros_conversions::toInfo(report);
    info.header.stamp = stamp;
    info.header.frame_id = ros_conversions::cleanFrameId(options_.output.map_frame_id);
    info.optimise_time = static_cast<float>(session.optimise_time);
    info.located = session.isLocated();
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

  /// Of the base in the map, at the newest key frame.
  void publishPose(const ros::Time& stamp) {
    const PlaceRecognition& recognition = session_->recognition();
    const std::optional<Matrix6d> of_camera = recognition.covariance();
    const std::optional<Eigen::Isometry3d> T_base_camera = mount_->last();
    if (!of_camera || !T_base_camera) return;
    const Eigen::Isometry3d T_map_base = recognition.graph().nodes().rbegin()->second * T_base_camera->inverse();
    const Matrix6d to_base = adjoint(*T_base_camera);
    geometry_msgs::PoseWithCovarianceStamped pose;
    pose.header.stamp = stamp;
    pose.header.frame_id = ros_conversions::cleanFrameId(options_.output.map_frame_id);
    pose.pose = ros_conversions::toMessage(T_map_base, to_base * *of_camera * to_base.transpose());
    publisher_->publish(pose);
  }

  void restart(const char* why) {
    NODELET_WARN_STREAM(why << ": " << session_->recognition().places().size() << " places are forgotten");
    replace(std::make_shared<PlaceSession>(options_.recognition));
  }

  void replace(std::shared_ptr<PlaceSession> session) {
    session_ = std::move(session);
    was_located_ = session_->isLocated();
    publisher_->forget();
    diagnostics_->restart();
  }

  /// In the optimiser's thread, which works on a copy while the graph grows.
  void optimise(const Job& job) try {
    PoseGraph graph = job.graph;
    const PoseGraph::Summary summary = graph.optimise();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (job.session != session_) return;
    PlaceSession& session = *session_;
    session.optimise_time = summary.time;
    if (!session.recognition().adopt(graph)) {
      optimiser_->push({session.recognition().graph(), session_});
      return;
    }
    if (session.isPlaced()) publisher_->correct(session.recognition().T_map_odom(), session.odomFrame(), false);
    publisher_->noteChange();
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM("the map was not optimised: " << e.what());
  }

  /// For the publisher.
  PlacePublisher::Map map() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return {session_->map(), mount_->last()};
  }

  // The other robot, in the thread of what takes its time.

  OtherRobot::Places placesForOthers() {
    OtherRobot::Places places;
    places.find = [this](const OtherRobot::SignatureMessage& signature) {
      const std::lock_guard<std::mutex> lock(mutex_);
      const PlaceRecognition& recognition = session_->recognition();
      if (recognition.places().empty()) return std::vector<PlaceCandidate>();
      return recognition.find(ros_conversions::fromMessage(signature, options_.recognition.index,
                                                           recognition.places().begin()->second.features.kind()));
    };
    places.verify = [this](int id, const Place& other) -> std::optional<stereo_descriptor_vo::PlaceMatch> {
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto mine = session_->recognition().places().find(id);
      if (mine == session_->recognition().places().end()) return std::nullopt;
      const PlaceMatch match = session_->recognition().verify(id, other.features);
      if (!match.same) return std::nullopt;
      return ros_conversions::toMessage(match, mine->second, other, session_->stream().frame_id);
    };
    places.get = [this](int id) {
      const std::lock_guard<std::mutex> lock(mutex_);
      return session_->message(id, robot_);
    };
    places.publish = [this](const stereo_descriptor_vo::PlaceMatch& match) { publisher_->publish(match); };
    places.warn = [this](const std::string& what) { NODELET_WARN_STREAM(what); };
    return places;
  }

  // The services.

  bool onReset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++generation_;
    restart("reset was called");
    return true;
  }

  /// A paused nodelet subscribes to nothing: the image side has one listener less.
  bool onPause(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    response.success = true;
    response.message = subscribers_.empty() ? "was paused already" : "paused";
    subscribers_.clear();
    diagnostics_->input().noteIdle("paused");
    return true;
  }

  bool onResume(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    response.success = true;
    response.message = subscribers_.empty() ? "resumed; the way in between is unknown" : "was not paused";
    if (!subscribers_.empty()) return true;
    ++resumes_;
    diagnostics_->input().noteIdle("");
    subscribe();
    return true;
  }

  bool onSavePlaces(stereo_descriptor_vo::SavePlaces::Request& request,
                    stereo_descriptor_vo::SavePlaces::Response& response) try {
    std::unique_lock<std::mutex> lock(mutex_);
    const std::vector<Place> places = session_->places();
    const ros_conversions::MapState state = session_->map();
    const ros_conversions::FeatureStream stream = session_->stream();
    lock.unlock();
    if (places.empty()) throw std::runtime_error("there is no place yet");
    if (options_.recognition.localisation_only)
      throw std::runtime_error("localisation_only: the map is still that of the file it was loaded from");
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
    std::shared_ptr<PlaceSession> loaded = load(request.path);
    const std::lock_guard<std::mutex> lock(mutex_);
    loaded->refuseOtherCameraThan(*session_);
    response.message = std::to_string(loaded->recognition().places().size()) + " places; " +
                       std::to_string(session_->recognition().places().size()) + " of before are forgotten";
    ++generation_;
    replace(std::move(loaded));
    response.success = true;
    return true;
  } catch (const std::exception& e) {
    response.message = e.what();
    return true;
  }

  /// A session that begins with the places of a file. Throws std::runtime_error or std::invalid_argument.
  std::shared_ptr<PlaceSession> load(const std::string& path) const {
    return std::make_shared<PlaceSession>(options_.recognition, loadPlaces(path, options_.recognition.graph));
  }

  bool onGetPlace(stereo_descriptor_vo::GetPlace::Request& request,
                  stereo_descriptor_vo::GetPlace::Response& response) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (const auto place = session_->message(static_cast<int>(request.id), robot_)) {
      response.place = *place;
      response.success = true;
    } else {
      response.message = "there is no place " + std::to_string(request.id);
    }
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
  std::shared_ptr<PlaceSession> session_;        // and all in it: under mutex_
  bool was_located_ = false;                     // … and map -> odom is published since then
  std::atomic<int> generation_{0}, resumes_{0};  // sessions that a service began, and times of resuming

  std::unique_ptr<Worker<Arrived>> observer_;
  std::unique_ptr<Worker<Job>> optimiser_;
  std::unique_ptr<OtherRobot> other_;

  // Only the callbacks' thread touches these.
  std::unique_ptr<ExactSynchroniser<Features, Odometry, Info>> synchroniser_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Subscriber initial_pose_subscriber_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::PlaceRecognitionNodelet, nodelet::Nodelet)
