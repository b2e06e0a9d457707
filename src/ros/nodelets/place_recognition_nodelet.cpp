#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <stereo_descriptor_vo/GetPlace.h>
#include <stereo_descriptor_vo/LoadPlaces.h>
#include <stereo_descriptor_vo/SavePlaces.h>

#include <atomic>
#include <filesystem>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../../common/worker.hpp"
#include "../../config/interface_options.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/stamps.hpp"
#include "../diagnostics/diagnostics.hpp"
#include "../files/output_files.hpp"
#include "../files/places_file.hpp"
#include "../node/signals.hpp"
#include "../places/other_robot.hpp"
#include "../places/place_session.hpp"
#include "../publishers/place_publisher.hpp"
#include "../synchronisation/odometry_pair_input.hpp"
#include "../transforms/camera_mount.hpp"
#include "robot_nodelet.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"

namespace sdvo {

using ros_conversions::cleanFrameId;

/// Stereo feature messages and their odometry in; a map of places and the odometry's pose in it out. Without images.
class PlaceRecognitionNodelet : public RobotNodelet {
 public:
  ~PlaceRecognitionNodelet() override {
    stopping_ = true;
    stopThreads();
    if (observer_) observer_->stop();
    if (optimiser_) optimiser_->stop();
    if (options_.save_at_shutdown && input_) autosave(true);
  }

 private:
  /// A pair with the generation_ of the session at its arrival.
  struct Arrived {
    OdometryPair pair;
    int generation;
  };

  struct Job {
    PoseGraph graph;
    std::shared_ptr<PlaceSession> session;
  };

  void begin() override {
    CallbackThread &callbacks = addThread(), &slow_callbacks = addThread();  // messages; what takes its time
    nh_ = callbacks.serve(getNodeHandle());
    ros::NodeHandle private_nh = callbacks.serve(getPrivateNodeHandle());
    ros::NodeHandle slow_nh = slow_callbacks.serve(getPrivateNodeHandle());
    ros::NodeHandle other_nh = slow_callbacks.serve(getNodeHandle());
    ros::NodeHandle disk_nh = addThread().serve(getPrivateNodeHandle());  // files
    loadOptions(private_nh, options_, recognition_options_);
    ros_conversions::requireName({"map_frame_id", options_.map_frame_id});
    options_.map_frame_id = cleanFrameId(options_.map_frame_id);
    robot_ = options_.robot_name.empty() ? nh_.getNamespace() : options_.robot_name;
    ours_.session = std::make_shared<PlaceSession>(recognition_options_);
    if (options_.save_at_shutdown && (options_.places_file.empty() || recognition_options_.localisation_only))
      throw std::invalid_argument("save_at_shutdown needs a places_file, and a map that is not localisation_only");
    if (!options_.places_file.empty()) beginWith(inRosHome(options_.places_file));

    const std::uint32_t tag = TransformPublisher::tagOf(getName());
    transforms_ = std::make_unique<RobotTransforms>(nh_, std::nullopt, tag,
                                                    [this](const std::string& what) { SDVO_WARN(what, what); });
    mount_ = std::make_unique<CameraMount>(*transforms_);
    publisher_ = std::make_unique<PlacePublisher>(nh_, options_, robot_, tag, [this] { return map(); });
    using namespace stereo_descriptor_vo;
    serveReset(private_nh, [this] { reset(); });
    serve<SavePlaces>(disk_nh, "save_places", [this](const auto& request, auto& response) {
      response.message = save(inRosHome(request.path));
    });
    serve<LoadPlaces>(disk_nh, "load_places", [this](const auto& request, auto& response) {
      response.message = replaceBy(inRosHome(request.path));
    });
    serve<GetPlace>(slow_nh, "get_place", [this](const auto& request, auto& response) {
      const std::lock_guard<std::mutex> lock(ours_.mutex);
      const auto place = ours_.session->message(static_cast<int>(request.id), robot_);
      if (!place) throw std::invalid_argument("there is no place " + std::to_string(request.id));
      response.place = *place;
    });
    if (options_.save_at_shutdown) {
      endAsBySigint();
      saving_ = disk_nh.createWallTimer(kSavePeriod, [this](const ros::WallTimerEvent&) { autosave(false); });
    }
    observer_ = std::make_unique<Worker<Arrived>>(static_cast<std::size_t>(options_.queue_size),
                                                  [this](const Arrived& arrived) { observe(arrived); });
    optimiser_ = std::make_unique<Worker<Job>>(1, [this](const Job& job) { optimise(job); });
    other_ = std::make_unique<OtherRobot>(
        other_nh, robot_, ours_, *publisher_,
        [this](const std::string& what, const std::string& kind) { SDVO_WARN(kind, what); });
    unused_ = std::make_unique<UnusedInput>("pairs", RateOptions().max_unused);
    input_ = std::make_unique<OdometryPairInput>(
        nh_, options_.sync_queue_size, *unused_, [this](const OdometryPair& pair) { onPair(pair); },
        [this](const std::string& topic, const ros::Time& stamp, const std::string& why) {
          SDVO_ERROR(topic + why, topic << ": message at " << stamp << " skipped: " << why);
        });
    diagnostics_ = std::make_unique<PlaceDiagnostics>(nh_, private_nh, getName(), input_->topics(),
                                                      options_.max_silence, *unused_);
    servePauses(private_nh, input_->subscriptions(), diagnostics_->input(), "the way in between is unknown");
    // In our namespace, and in the one above, where an rviz of the robot publishes.
    for (const std::string& topic :
         std::set<std::string>{nh_.resolveName("initialpose"),
                               ros::names::append(ros::names::parentNamespace(nh_.getNamespace()), "initialpose")})
      initial_pose_subscribers_.push_back(nh_.subscribe<geometry_msgs::PoseWithCovarianceStamped>(
          topic, 1, [this](const geometry_msgs::PoseWithCovarianceStamped::ConstPtr& m) { onInitialPose(*m); }));
  }

  /// Begins with the places of places_file. It need not exist: a robot's first map has none.
  void beginWith(const std::string& path) {
    map_file_ = path;
    if (options_.save_at_shutdown) WholeFile{path};  // throws where the end could not write it
    kept_ = 0;
    if (!std::filesystem::exists(path)) {
      NODELET_WARN_STREAM("places_file '" << path
                                          << "' does not exist: begins without places, save_places writes such a file");
      return;
    }
    ours_.session = load(path);
    kept_ = ours_.session->recognition().places().size();
    NODELET_INFO_STREAM(*kept_ << " places of '" << path << "'");
  }

  // Input, in the callbacks' thread.

  void onInitialPose(const geometry_msgs::PoseWithCovarianceStamped& message) try {
    const std::lock_guard<std::mutex> lock(ours_.mutex);
    if (ours_.session->isMapping() && !options_.initialpose_while_mapping)
      throw std::invalid_argument(
          "it would move the robot while its map grows; set initialpose_while_mapping for that");
    NODELET_WARN_STREAM("initialpose: " << ours_.session->expect(message, options_.map_frame_id));
  } catch (const std::exception& e) {
    NODELET_WARN_STREAM("the pose on initialpose is not used: " << e.what());
  }

  /// Throws std::invalid_argument if map and odometry have the same frame.
  void onPair(const OdometryPair& pair) {
    diagnostics_->input().note(nanoseconds(pair.features->header.stamp));
    const std::string &map_frame = options_.map_frame_id, &odom_frame = pair.odometry->header.frame_id;
    ros_conversions::requireTwoFrames({"map_frame_id", map_frame}, {"the odometry's odom_frame_id", odom_frame});
    if (options_.publish_tf) transforms_->setOwnFrames({map_frame, cleanFrameId(odom_frame)});
    if (!observer_->push({pair, generation_})) unused_->add(UnusedInput::kPushedOut);
  }

  // Recognition, in the observer's thread.

  void observe(const Arrived& arrived) try {
    const OdometryPair& pair = arrived.pair;
    const ros::Time stamp = pair.features->header.stamp;
    const std::optional<Eigen::Isometry3d> T_base_camera = findExtrinsic(pair);
    if (!T_base_camera) return;
    std::unique_lock<std::mutex> lock(ours_.mutex);
    if (arrived.generation != generation_) return;
    const PlaceSession::Time time = ours_.session->noteTime(stamp, ros::Time::now(), ros::Time::isSimTime());
    if (time == PlaceSession::Time::kStands) return;
    if (time == PlaceSession::Time::kBeganAnew) {
      const std::string file = map_file_;
      lock.unlock();  // the disk is slow
      std::shared_ptr<PlaceSession> anew = sessionOf(file);
      lock.lock();
      if (arrived.generation != generation_) return;
      restart("the clock jumped back", std::move(anew));
    }
    if (time == PlaceSession::Time::kFell)
      NODELET_WARN_STREAM("the stamps of the features jumped back to "
                          << stamp << " (camera driver restarted?): the places stay, the motion in between is unknown");
    if (const std::optional<PlaceReport> report = ours_.session->observe(pair, *T_base_camera)) publish(*report, stamp);
  } catch (const std::exception& e) {
    unused_->add(UnusedInput::kRefused);
    SDVO_ERROR(e.what(), "pair at " << arrived.pair.features->header.stamp << " skipped: " << e.what());
  }

  std::optional<Eigen::Isometry3d> findExtrinsic(const OdometryPair& pair) {
    const std::string base_frame = cleanFrameId(pair.odometry->child_frame_id);
    const std::string camera_frame = cleanFrameId(pair.features->header.frame_id);
    // After a reset, which lets the distance fall, the odometry reads the mount again, and so does this nodelet. After
    // other changes of the epoch it stays.
    const stereo_descriptor_vo::VoInfo::ConstPtr before = std::exchange(mount_of_, pair.info);
    const double since_reset = pair.info->distance;
    if (before && (before->session != pair.info->session ||
                   (before->epoch != pair.info->epoch && (since_reset <= 0.0 || since_reset < before->distance))))
      mount_->forget();
    mount_->await(base_frame, camera_frame, [this] { return stopping_ || observer_->isFull(); });
    std::string problem;
    const std::optional<Eigen::Isometry3d> found = mount_->find(base_frame, camera_frame, problem);
    if (!found) SDVO_ERROR("extrinsic", transforms_->explainMissing(base_frame, camera_frame) << ". " << problem);
    return found;
  }

  /// Under the lock, as are the functions below. `report`: of the session's newest key frame.
  void publish(const PlaceReport& report, const ros::Time& stamp) {
    const PlaceSession& session = *ours_.session;
    const PlaceRecognition& recognition = session.recognition();
    if (report.loop) {
      NODELET_INFO_STREAM("key frame " << report.id << " shows the place of key frame " << *report.same << ": a loop");
      optimiser_->push({recognition.graph(), ours_.session});
    }
    if (session.isPlaced())
      publisher_->correct(recognition.T_map_odom(), session.odomFrame(), !was_located_ || !session.isLocated());
    was_located_ = session.isLocated();
    if (auto pose = was_located_ ? session.basePose(*mount_->last()) : std::nullopt) {
      pose->header.stamp = stamp;
      pose->header.frame_id = options_.map_frame_id;
      publisher_->publish(*pose);
    }
    noteChange();
    if (const auto signature = session.signature(report.id, robot_)) publisher_->publish(*signature);
    stereo_descriptor_vo::PlaceInfo info = session.info(report);
    info.header.stamp = stamp;
    info.header.frame_id = options_.map_frame_id;
    info.dropped_pairs = unused_->count(UnusedInput::kPushedOut);
    info.unpaired = unused_->count(UnusedInput::kUnpaired);
    info.malformed = unused_->count(UnusedInput::kRefused);
    publisher_->publish(info);
    diagnostics_->note(info);
  }

  void restart(const char* why, std::shared_ptr<PlaceSession> anew) {
    NODELET_WARN_STREAM(why << ": " << ours_.session->recognition().places().size() << " places are forgotten"
                            << (map_file_.empty() ? "" : ", but for those of '" + map_file_ + "'"));
    replace(std::move(anew));
  }

  /// A session with the places of a file, if it exists and can be read.
  std::shared_ptr<PlaceSession> sessionOf(const std::string& file) const try {
    return std::filesystem::exists(file) ? load(file) : std::make_shared<PlaceSession>(recognition_options_);
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM("begins without places, those of the file cannot be read: " << e.what());
    return std::make_shared<PlaceSession>(recognition_options_);
  }

  void replace(std::shared_ptr<PlaceSession> session) {
    ours_.session = std::move(session);
    was_located_ = ours_.session->isLocated();
    publisher_->forget();
    diagnostics_->restart();
  }

  /// In the optimiser's thread, on a copy, because the graph grows meanwhile.
  void optimise(const Job& job) try {
    PoseGraph graph = job.graph;
    const PoseGraph::Summary summary = graph.optimise();
    const std::lock_guard<std::mutex> lock(ours_.mutex);
    if (job.session != ours_.session) return;
    PlaceSession& session = *ours_.session;
    session.optimise_time = summary.time;
    if (!session.recognition().adopt(graph)) {
      optimiser_->push({session.recognition().graph(), ours_.session});
      return;
    }
    if (session.isPlaced()) publisher_->correct(session.recognition().T_map_odom(), session.odomFrame(), false);
    noteChange();
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM("the map was not optimised, its poses stay as they are: " << e.what());
  }

  void noteChange() {
    ++changes_;
    publisher_->noteChange();
  }

  /// For the publisher.
  PlacePublisher::Map map() {
    const std::lock_guard<std::mutex> lock(ours_.mutex);
    return {ours_.session->map(), mount_->last()};
  }

  // The services.

  void reset() {
    const std::lock_guard<std::mutex> lock(ours_.mutex);
    ++generation_;
    map_file_.clear();
    kept_.reset();
    restart("reset was called", std::make_shared<PlaceSession>(recognition_options_));
  }

  /// Returns the number of places and the file in words.
  std::string save(const std::string& path) {
    std::unique_lock<std::mutex> lock(ours_.mutex);
    const SavedPlaces saved = ours_.session->saved();
    const int changes = changes_, generation = generation_;
    lock.unlock();
    if (saved.places.empty())
      throw std::runtime_error("there is no place to save yet: a key frame needs a pair with odometry");
    if (recognition_options_.localisation_only)
      throw std::runtime_error(
          "not saved: localisation_only keeps the map as it is in the file that it was loaded from");
    savePlaces(saved, robot_, options_.map_frame_id, path, options_.overwrite);
    lock.lock();
    if (generation == generation_ && path == inRosHome(options_.places_file)) {
      kept_ = saved.places.size();
      saved_changes_ = changes;
    }
    return std::to_string(saved.places.size()) + " places in '" + path + "'";
  }

  /// Saves the map in places_file without a call: each minute if it changed, and at the end. At the end roslaunch
  /// grants 15 s, and rosconsole is gone.
  void autosave(bool at_end) {
    const std::string path = inRosHome(options_.places_file);
    const auto say = [&](const std::string& what) {
      if (at_end)  // rosconsole ends while this runs
        std::cerr << "[ WARN] " << getName() << ": " << what << std::endl;
      else
        NODELET_WARN_STREAM(what);
    };
    std::unique_lock<std::mutex> lock(ours_.mutex);
    const std::size_t places = ours_.session->recognition().places().size(), before = kept_.value_or(0);
    const bool would_lose_places = !kept_ || places < before;
    const bool has_changed = changes_ != saved_changes_ && places > 0;
    lock.unlock();
    if (!has_changed || (!at_end && ros::SteadyTime::now() < next_save_)) return;
    if (would_lose_places && std::filesystem::exists(path) && !options_.overwrite) {
      if (at_end)
        say("the map's " + std::to_string(places) + " places are not saved: '" + path +
            "' has others, or more; call save_places before the end, or set place_recognition/overwrite");
      return;
    }
    if (at_end)
      say("saving " + std::to_string(places) + " places in '" + path + "', which has " + std::to_string(before));
    const ros::SteadyTime begin = ros::SteadyTime::now();
    try {
      const std::string saved = save(path);
      if (at_end) say("saved: " + saved);
    } catch (const std::exception& e) {
      say(std::string("the map is not saved: ") + e.what());
    }
    next_save_ = ros::SteadyTime::now() + (ros::SteadyTime::now() - begin) * kRests;
  }

  /// Begins anew with the places of a file. Returns their number in words.
  std::string replaceBy(const std::string& file) {
    std::shared_ptr<PlaceSession> loaded = load(file);
    const std::lock_guard<std::mutex> lock(ours_.mutex);
    loaded->refuseOtherCameraThan(*ours_.session);
    const std::size_t places = loaded->recognition().places().size();
    const std::string outcome = std::to_string(places) + " places; " +
                                std::to_string(ours_.session->recognition().places().size()) +
                                " of before are forgotten";
    ++generation_;
    replace(std::move(loaded));
    map_file_ = file;
    kept_.reset();
    if (file == inRosHome(options_.places_file)) kept_ = places;
    return outcome;
  }

  /// A session that begins with the places of a file. Throws std::runtime_error or std::invalid_argument.
  std::shared_ptr<PlaceSession> load(const std::string& path) const {
    return std::make_shared<PlaceSession>(recognition_options_, loadPlaces(path));
  }

  static constexpr double kRests = 20.0;      // ratio of the pause to the time that saving took (chosen)
  const ros::WallDuration kSavePeriod{60.0};  // s, the most that a killed process loses (chosen)

  ros::NodeHandle nh_;
  PlaceOutputOptions options_;
  PlaceRecognitionOptions recognition_options_;
  std::string robot_;
  std::unique_ptr<UnusedInput> unused_;
  std::unique_ptr<RobotTransforms> transforms_;
  std::unique_ptr<CameraMount> mount_;
  std::unique_ptr<PlacePublisher> publisher_;
  std::unique_ptr<PlaceDiagnostics> diagnostics_;
  ros::WallTimer saving_;
  ros::SteadyTime next_save_;  // the disk's thread

  SharedSession ours_;
  std::string map_file_;                 // file of its first places; empty: none
  std::optional<std::size_t> kept_;      // places in places_file; none: it has another map
  int changes_ = 0, saved_changes_ = 0;  // of the session; of it those in places_file
  bool was_located_ = false;             // at the last publish(): map -> odom is on TF
  std::atomic<int> generation_{0};       // sessions that a service began
  std::atomic<bool> stopping_{false};
  // Only the observer's thread touches this.
  stereo_descriptor_vo::VoInfo::ConstPtr mount_of_;

  std::unique_ptr<Worker<Arrived>> observer_;
  std::unique_ptr<Worker<Job>> optimiser_;
  std::unique_ptr<OtherRobot> other_;

  // Only the callbacks' thread touches these.
  std::unique_ptr<OdometryPairInput> input_;
  std::vector<ros::Subscriber> initial_pose_subscribers_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::PlaceRecognitionNodelet, nodelet::Nodelet)
