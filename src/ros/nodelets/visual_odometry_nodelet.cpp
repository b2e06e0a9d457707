#include <stereo_descriptor_vo/ResetToPose.h>
#include <stereo_descriptor_vo/SaveTrajectory.h>
#include <stereo_descriptor_vo/SetPose.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../../common/stamp_filter.hpp"
#include "../../common/worker.hpp"
#include "../../config/interface_options.hpp"
#include "../../matching/patch_alignment.hpp"
#include "../../messages/feature_conversions.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/pose_conversions.hpp"
#include "../../messages/stamps.hpp"
#include "../diagnostics/diagnostics.hpp"
#include "../files/output_files.hpp"
#include "../node/throttles.hpp"
#include "../publishers/odometry_publisher.hpp"
#include "../transforms/axes_watch.hpp"
#include "../transforms/camera_mount.hpp"
#include "../transforms/guess_input.hpp"
#include "../transforms/odometry_frames.hpp"
#include "../transforms/start_pose.hpp"
#include "robot_nodelet.hpp"
#include "stereo_descriptor_vo/messages/stereo_features_view.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo {

using ros_conversions::cleanFrameId;

/// Stereo feature messages in; odometry, TF and the state of both out. Never sees an image.
class VisualOdometryNodelet : public RobotNodelet {
 public:
  ~VisualOdometryNodelet() override {
    stopping_ = true;
    stopThreads();
    if (worker_) worker_->stop();
  }

 private:
  using FeaturesMessage = stereo_descriptor_vo::StereoFeatures;
  using FeaturesMessagePtr = stereo_descriptor_vo::StereoFeaturesConstPtr;

  /// A feature message with the time of its arrival, and the number of restarts and resumes by services before it.
  struct Arrived {
    FeaturesMessagePtr message;
    StereoFeaturesView view;
    std::int64_t now;  ///< ns, simulated or of a steady clock
    int starts, resumes;
  };
  using FeaturesFilter = StampFilter<Arrived>;

  void begin() override {
    CallbackThread& callbacks = addThread();
    nh_ = callbacks.serve(getNodeHandle());
    ros::NodeHandle private_nh = callbacks.serve(getPrivateNodeHandle());
    ros::NodeHandle slow_nh = addThread().serve(getPrivateNodeHandle());  // services that take their time
    ros::NodeHandle disk_nh = addThread().serve(getPrivateNodeHandle());  // services that write files
    loadOptions(private_nh, options_, reconfigured_);
    if (options_.use_imu && !options_.guess_frame_id.empty())
      throw std::invalid_argument("use_imu and guess_frame_id exclude each other: set one of them");
    if (options_.awaitsMotion() && options_.guess_frame_id.empty())
      throw std::invalid_argument("guess_min_translation and guess_min_rotation need guess_frame_id: set it, too");
    options_ = withCleanFrames(options_);
    odometry_ = std::make_unique<VisualOdometry>(reconfigured_);
    const std::uint32_t tag = TransformPublisher::tagOf(getName());
    publisher_ = std::make_unique<OdometryPublisher>(nh_, options_, tag);
    const auto warn = [this](const std::string& what) { SDVO_WARN(what, what); };
    transforms_ = std::make_unique<RobotTransforms>(nh_, publishedFrames(options_), tag, warn);
    mount_ = std::make_unique<CameraMount>(*transforms_);
    unused_ = std::make_unique<UnusedInput>("feature messages", options_.rates.max_unused,
                                            std::set<int>{UnusedInput::kPushedOut});
    diagnostics_ = std::make_unique<OdometryDiagnostics>(nh_, private_nh, getName(), options_, *unused_);
    if (options_.use_imu) imu_ = std::make_unique<ImuInput>(nh_, *transforms_, *unused_, warn);
    guesses_ = std::make_unique<GuessInput>(options_, *transforms_, imu_.get());
    const auto place = [this](const Eigen::Isometry3d& T_odom_base) { publisher_->restart(T_odom_base); };
    start_ = std::make_unique<StartPose>(options_, *transforms_, imu_.get(), place, warnAlways());
    axes_.emplace(warnAlways());
    using namespace stereo_descriptor_vo;
    serveReset(slow_nh, [this] { startAgain(); });
    serve<ResetToPose>(slow_nh, "reset_to_pose",
                       [this](const auto& request, auto&) { startAgain(ros_conversions::toPose(request.pose)); });
    serve<SetPose>(slow_nh, "set_pose", [this](const auto& request, auto&) { setPose(request.pose); });
    serve<SaveTrajectory>(disk_nh, "save_trajectory", [this](const auto& request, auto& response) {
      response.message = save(request.format, inRosHome(request.path));
    });
    pose_subscriber_ = slow_nh.subscribe<geometry_msgs::PoseWithCovarianceStamped>(
        "set_pose", 1, [this](const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose) {
          try {
            setPose(*pose);
          } catch (const std::invalid_argument& e) {
            NODELET_ERROR_STREAM("set_pose: " << e.what());
          }
        });

    VisualOdometryOptions defaults;
    reconfigure_server_ = std::make_unique<ReconfigureServer>(
        slow_nh, listOptions(reconfigured_),
        [this] {
          VisualOdometry{reconfigured_};  // throws when they do not go together
          reconfigurations_.post(reconfigured_);
        },
        listOptions(defaults));

    worker_ = std::make_unique<Worker<FeaturesFilter::Passed>>(
        static_cast<std::size_t>(options_.queue_size),
        [this](const FeaturesFilter::Passed& passed) { process(passed); });
    // Without a subscriber the image side rests, too.
    input_ = std::make_unique<PausableInput>([this] { return subscribe(); }, [this] { resumes_.post({}); });
    servePauses(private_nh, *input_, diagnostics_->input(), "the motion in between is unknown");
    if (!options_.awaitsMotion()) return;
    ros::NodeHandle rest_nh = addThread().serve(getNodeHandle());
    rest_timer_ = rest_nh.createWallTimer(ros::WallDuration(kRestPeriod),
                                          [this](const ros::WallTimerEvent&) { restWhileStanding(); });
  }

  std::vector<ros::Subscriber> subscribe() {
    const auto queue = static_cast<std::uint32_t>(std::max(kArrivalQueue, options_.queue_size));
    return {nh_.subscribe<FeaturesMessage>(
        "stereo_features", queue, [this](const FeaturesMessagePtr& m) { onFeatures(m); }, ros::VoidConstPtr(),
        ros::TransportHints().tcpNoDelay())};
  }

  /// Of what happens seldom.
  std::function<void(const std::string&)> warnAlways() {
    return [this](const std::string& what) { NODELET_WARN_STREAM(what); };
  }

  void onFeatures(const FeaturesMessagePtr& message) try {
    if (input_->isPaused()) return;
    const std::uint64_t now = ros::Time::isSimTime() ? ros::Time::now().toNSec() : ros::SteadyTime::now().toNSec();
    const std::string problem = whyUnusable(message->header.stamp);
    if (!problem.empty()) throw std::invalid_argument(problem);
    Arrived arrived{message, StereoFeaturesView(*message), static_cast<std::int64_t>(now), starts_, resumes_.posted()};
    const std::uint64_t late = filter_.dropped();
    const bool new_stream = stream_epoch_ && *stream_epoch_ != message->stream_epoch;
    std::vector<FeaturesFilter::Passed> passed =
        filter_.add(std::move(arrived), nanoseconds(message->header.stamp), nanoseconds(ros::Time::now()), new_stream);
    // The first of two was held, here and perhaps by the image side, until the next one confirmed its stamp. So its
    // arrival is too late: it becomes the next one's, less the difference of their stamps.
    if (passed.size() == 2) {
      Arrived &held = passed[0].item, &next = passed[1].item;
      const auto stamp = [](const Arrived& item) { return nanoseconds(item.message->header.stamp); };
      held.now = std::min(held.now, next.now - (stamp(next) - stamp(held)));
    }
    for (FeaturesFilter::Passed& item : passed)
      if (!worker_->push(std::move(item))) unused_->add(UnusedInput::kPushedOut);
    stream_epoch_ = message->stream_epoch;
    unused_->add(UnusedInput::kLate, filter_.dropped() - late);
    if (filter_.dropped() > late)
      SDVO_WARN("late", "features near " << message->header.stamp << " are late or have a wrong stamp: dropped ("
                                         << filter_.dropped()
                                         << " so far); if this goes on, check the driver's stamps");
  } catch (const std::exception& e) {
    unused_->add(UnusedInput::kRefused);
    SDVO_ERROR(e.what(), "features at " << message->header.stamp << " skipped: " << e.what());
  }

  /// In the worker's thread.
  void process(const FeaturesFilter::Passed& passed) try {
    const Guess guess = waitForOthers(passed);
    const std::lock_guard<std::mutex> lock(work_mutex_);
    if (passed.item.starts != starts_) return;
    if (std::exchange(rests_, false)) diagnostics_->input().noteIdle("");
    if (const ros::Time stamp = passed.item.message->header.stamp;
        guess.T_guess_base && isLeftOut(*guess.T_guess_base, stamp)) {
      diagnostics_->input().note(nanoseconds(stamp));
      publisher_->sendCorrection(stamp);
      return unused_->noteUsed();
    }
    const WorkLoad::Item work(diagnostics_->load());
    publishInfo(estimate(passed, guess), *passed.item.message);
    unused_->noteUsed();
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM("features at " << passed.item.message->header.stamp << ": no vo_info: " << e.what());
  }

  /// The last processed pair, and the camera's motion since then, if they are known.
  struct Guess {
    std::optional<GuessInput::Begin> since;
    std::optional<MotionGuess> motion;
    std::optional<Eigen::Isometry3d> T_guess_base;  ///< now, only where pairs may be left out
  };

  /// Whether the base has hardly moved since the last processed pair, in which the odometry was sure.
  bool isLeftOut(const Eigen::Isometry3d& T_guess_base, const ros::Time& stamp) const {
    if (!processed_ || !processed_->T_guess_base) return false;
    const Eigen::Isometry3d motion = processed_->T_guess_base->inverse() * T_guess_base;
    return options_.isLeftOut(motion.translation().norm(), Eigen::AngleAxisd(motion.linear()).angle(),
                              secondsBetween(processed_->stamp, stamp));
  }

  /// Unsubscribes the features while pairs would be left out, so that the image side rests, too. Not where the guess is
  /// old: it may have ended.
  void restWhileStanding() {
    const std::lock_guard<std::mutex> lock(work_mutex_);
    const ros::Time now = ros::Time::now();
    const bool is_fresh = now.toSec() > kStanding && guesses_->base(now - ros::Duration(kStanding));
    const auto newest = guesses_->base(ros::Time(0));
    const bool stands = is_fresh && newest && isLeftOut(*newest, now);
    if (!stands) moved_at_ = steadyTime();
    const bool rests = stands && steadyTime() - moved_at_ > kStanding;
    input_->setResting(rests);
    if (!rests) return;
    rests_ = true;
    if (!input_->isPaused()) diagnostics_->input().noteIdle("the base stands, by " + options_.guess_frame_id);
    if (now != std::exchange(corrected_at_, now)) publisher_->sendCorrection(now);
  }

  /// Waits for the camera's mount on TF and for a guess by another odometry or the gyro. Without the lock, which
  /// services need.
  Guess waitForOthers(const FeaturesFilter::Passed& passed) {
    const std_msgs::Header& header = passed.item.message->header;
    const auto isVoid = [&] { return stopping_ || passed.item.starts != starts_; };
    const std::string camera_frame = cleanFrameId(header.frame_id);
    const double begin = steadyTime();
    // With a full queue the next pair would be dropped: stop waiting.
    mount_->await(options_.base_frame_id, camera_frame, [&] { return isVoid() || worker_->isFull(); });
    diagnostics_->load().noteWait("the transform base <- camera", steadyTime() - begin);
    Guess guess;
    {
      const std::lock_guard<std::mutex> lock(work_mutex_);
      if (!imu_ || axes_->trustsGyro()) guess.since = processed_;
    }
    // By TF it is the base's motion in the axes of the last mount, which is not that of another camera's first pair.
    const bool has_axes = options_.guess_frame_id.empty() || mount_->knows(options_.base_frame_id, camera_frame);
    if (guess.since && mount_->last() && has_axes && guesses_->hasSource())
      guess.motion = awaitGuess(*guess.since, header, isVoid);
    if (options_.awaitsMotion()) guess.T_guess_base = guesses_->base(header.stamp);
    return guess;
  }

  /// Publishes everything of a pair but vo_info.
  OdometryResult estimate(const FeaturesFilter::Passed& passed, const Guess& guess) try {
    const FeaturesMessage& message = *passed.item.message;
    if (const auto options = reconfigurations_.take()) odometry_->configure(*options);
    noteJumps(passed);
    if (resumes_.take(passed.item.resumes)) odometry_->breakStream();
    StereoFeatures features = ros_conversions::fromMessage(passed.item.view);
    features.stamp += time_shift_;
    std::string problem = findExtrinsic(cleanFrameId(message.header.frame_id));
    if (problem.empty()) problem = start_->find(message.header.stamp);
    const OdometryResult result = problem.empty() ? track(features, message, guess) : waitFor(problem);
    publisher_->publishPoints(passed.item.view);
    publisher_->publishFlow(result, features, message.header);
    return result;
  } catch (const std::exception& e) {
    SDVO_ERROR(e.what(), "features at " << passed.item.message->header.stamp << " skipped: " << e.what());
    return waitFor(std::string("features skipped: ") + e.what());
  }

  /// If simulated time jumps back (a bag is played again), the odometry restarts. If stamps jump to either side, the
  /// camera's or system's clock was set: the interval of the pairs is that of their arrivals.
  void noteJumps(const FeaturesFilter::Passed& passed) {
    constexpr std::int64_t kJump = 1000000000, kLeast = 1000000;  // ns: as the filter's; least time between two pairs
    const std::int64_t stamp = nanoseconds(passed.item.message->header.stamp), now = passed.item.now;
    const auto before = std::exchange(last_arrival_, std::pair(stamp, now));
    const bool source_restarted = std::exchange(source_restarts_, passed.source_restarts) != passed.source_restarts;
    const bool clock_set = std::exchange(clock_steps_, passed.clock_steps) != passed.clock_steps;
    if (clock_set && ros::Time::isSimTime()) return restart("the clock jumped back");
    if (!before) return;
    const std::int64_t by_stamps = stamp - before->first, by_arrivals = std::max(now - before->second, kLeast);
    const bool is_regular = by_stamps > 0 && (by_stamps <= kJump || std::abs(by_stamps - by_arrivals) <= kJump);
    if (is_regular) return;
    NODELET_WARN_STREAM((clock_set          ? "the system's clock was set back"
                         : source_restarted ? "the stamps of the features jumped back"
                                            : "the stamps of the features jumped ahead")
                        << " to " << passed.item.message->header.stamp << ": the odometry goes on, "
                        << 1e-9 * static_cast<double>(by_arrivals) << " s after the pair before");
    time_shift_ += by_arrivals - by_stamps;
    processed_.reset();
  }

  OdometryResult track(const StereoFeatures& features, const FeaturesMessage& message, const Guess& guess) {
    if (processed_epoch_ && *processed_epoch_ != message.stream_epoch) odometry_->breakStream();
    processed_epoch_ = message.stream_epoch;
    const std::string complaint = alignmentComplaint(features.patch_layout.side);
    if (!complaint.empty()) SDVO_WARN("patches", complaint);
    odometry_->mountAt(*mount_->last());
    const bool has_jumped = !processed_ || !guess.since || guess.since->stamp != processed_->stamp;
    const std::optional<MotionGuess> motion = has_jumped ? std::nullopt : guess.motion;
    OdometryResult result = odometry_->update(features, motion);
    result.stamp = nanoseconds(message.header.stamp);
    if (result.state == TrackingState::kTracking && result.has_motion) compareAxes(result, motion, message.header);
    processed_ = {message.header.stamp, std::nullopt};
    epoch_ = result.epoch;
    report(result, message.header.stamp);
    std::optional<Eigen::Isometry3d> T_guess_base;
    if (options_.correctsGuess() || options_.awaitsMotion()) T_guess_base = guesses_->base(message.header.stamp);
    if (options_.awaitsMotion() && result.state == TrackingState::kTracking) processed_->T_guess_base = T_guess_base;
    publisher_->publish(result, *mount_->last(), T_guess_base);
    publisher_->publishErrors([this](const ros::Time& stamp) {
      std::string ignored;
      return start_->truth(stamp, ignored);
    });
    if (publisher_->wantsMap() && result.has_pose)
      publisher_->publishMap(odometry_->mapPoints(), result.T_origin_camera, message.header);
    return result;
  }

  void compareAxes(const OdometryResult& result, const std::optional<MotionGuess>& guess,
                   const std_msgs::Header& header) {
    axes_->add(*mount_->last(), base_is_camera_, result.T_previous_current, odometry_->options().planar);
    constexpr double kSame = 1e-3;  // s: after an outage the motion is of another time than the guess
    if (guess && guess->rotation_only && std::abs(secondsBetween(processed_->stamp, header.stamp) - result.dt) <= kSame)
      axes_->addGyro(*imu_, cleanFrameId(header.frame_id), processed_->stamp, header.stamp,
                     guess->T_previous_current.linear(), result.T_previous_current.linear());
  }

  OdometryResult waitFor(const std::string& what) const {
    OdometryResult waiting;
    waiting.reason = what;
    waiting.epoch = epoch_;
    return waiting;
  }

  void publishInfo(const OdometryResult& result, const FeaturesMessage& message) {
    stereo_descriptor_vo::VoInfo info = ros_conversions::toInfo(result, message);
    info.dropped_features = unused_->count(UnusedInput::kPushedOut);
    info.out_of_order = unused_->count(UnusedInput::kLate);
    info.malformed = unused_->count(UnusedInput::kRefused);
    info = publisher_->publishInfo(std::move(info), message.header.stamp);
    diagnostics_->note(info);
    if (std::abs(info.latency) > kOtherClock && !std::exchange(latency_reported_, true))
      NODELET_WARN_STREAM(checkLatency(info.latency, kOtherClock).text());
  }

  void report(const OdometryResult& result, const ros::Time& stamp) {
    const bool is_lost = result.state == TrackingState::kWaiting || result.state == TrackingState::kLost;
    if (result.state == TrackingState::kTracking) {
      if (is_tracking_ || !throttle_.allows("begins")) return;
      is_tracking_ = true;
      // The first pair has features and no matches yet.
      NODELET_INFO_STREAM("TRACKING at " << stamp << ", epoch " << result.epoch << ": "
                                         << (result.has_motion ? result.inliers : result.features) << " points");
      return;
    }
    if (is_lost) is_tracking_ = false;
    // A restart is a kind of its own, or the throttle would drop it as one of the predictions before it.
    const bool started_again = result.has_pose && !result.has_motion;
    SDVO_WARN(started_again ? "started again" : toString(result.state),
              toString(result.state) << " at " << stamp << ", epoch " << result.epoch << ", " << result.inliers
                                     << " of " << result.matches << " points: " << result.reason);
  }

  /// At a given pose of the base, or at the initial one.
  void restart(const char* why, const std::optional<Eigen::Isometry3d>& given = std::nullopt) {
    const Eigen::Isometry3d T_odom_start = given.value_or(start_->T_odom_base());
    NODELET_WARN_STREAM(
        why << ": the odometry starts again from "
            << (T_odom_start.isApprox(Eigen::Isometry3d::Identity()) ? "the origin" : "the given pose"));
    odometry_->reset();
    time_shift_ = 0;
    mount_->forget();
    axes_.emplace(warnAlways());
    start_->restart(given);
    processed_epoch_.reset();
    processed_.reset();
  }

  std::optional<MotionGuess> awaitGuess(const GuessInput::Begin& since, const std_msgs::Header& header,
                                        const std::function<bool()>& is_void) {
    const double begin = steadyTime();
    std::string problem;
    const auto guess = guesses_->await(since, header, *mount_->last(), is_void, problem);
    diagnostics_->load().noteWait("the guess of the motion", steadyTime() - begin);
    if (guess) return guess;
    unused_->add(UnusedInput::kNoGuess);
    SDVO_WARN("guess", "no guess of the motion until " << header.stamp << ", going on without: " << problem);
    return std::nullopt;
  }

  static double steadyTime() { return ros::SteadyTime::now().toSec(); }

  /// Finds the camera's pose on the robot. Returns what is missing; empty if it is known.
  std::string findExtrinsic(const std::string& camera_frame) {
    const std::string& base_frame = options_.base_frame_id;
    if (mount_->knows(base_frame, camera_frame)) {
      if (const std::string change = mount_->change(); !change.empty())
        NODELET_WARN_STREAM("TF: " << change << "; the odometry holds on to the transform that it began with. A camera "
                                   << "on a joint needs a base_frame_id that moves with it; after a new calibration of "
                                   << "the mount call reset");
      return "";
    }
    std::string problem;
    if (const std::optional<Eigen::Isometry3d> found = mount_->find(base_frame, camera_frame, problem)) {
      if (const Finding mount = checkMount(base_frame, camera_frame, *found); mount.isFault())
        NODELET_WARN_STREAM(mount.remedy);
      if (base_frame == camera_frame && !std::exchange(base_is_camera_, true)) start_->turnToOptical();
      if (!camera_frame_.empty() && camera_frame_ != camera_frame)
        NODELET_WARN_STREAM("the images' frame was '" << camera_frame_ << "' and is '" << camera_frame
                                                      << "' now: another camera goes on from the base's last pose "
                                                      << "(epoch + 1)");
      camera_frame_ = camera_frame;
      return "";
    }
    const std::string report = transforms_->explainMissing(base_frame, camera_frame);
    SDVO_ERROR("extrinsic", report << ". " << problem);
    return report;
  }

  // The services. They answer when the effect is there. Features that wait in the queue are dropped.

  void startAgain(const std::optional<Eigen::Isometry3d>& T_odom_base = std::nullopt) {
    const std::lock_guard<std::mutex> lock(work_mutex_);
    ++starts_;
    restart("reset was called", T_odom_base);
  }

  /// Sets the base's pose in odom, with its covariance, at the newest pair. Throws std::invalid_argument.
  void setPose(const geometry_msgs::PoseWithCovarianceStamped& message) {
    const std::string frame = cleanFrameId(message.header.frame_id);
    if (frame != options_.odom_frame_id)
      throw std::invalid_argument("the pose is in frame '" + frame + "', not in odom_frame_id");
    Eigen::Isometry3d T_odom_base;
    Matrix6d covariance;
    ros_conversions::fromMessage(message.pose, T_odom_base, covariance);
    const std::lock_guard<std::mutex> lock(work_mutex_);
    const std::optional<Eigen::Isometry3d> T_base_camera = mount_->last();
    if (!T_base_camera)
      throw std::invalid_argument("there is no pose yet: set initial_pose, or wait for the first pair");
    const Matrix6d to_camera = adjoint(T_base_camera->inverse());
    odometry_->setPoseCovariance(to_camera * covariance * to_camera.transpose());
    const Eigen::Isometry3d T_start_base = *T_base_camera * odometry_->lastPose() * T_base_camera->inverse();
    publisher_->moveTo(T_odom_base * T_start_base.inverse());
    start_->give();
  }

  /// Returns the number of poses and the file in words.
  std::string save(const std::string& format, const std::string& file) {
    const nav_msgs::Path path = publisher_->path();
    if (path.poses.empty()) throw std::runtime_error("there is no pose to save yet: reason of vo_info says why");
    if (!options_.overwrite && saved_.count(file) == 0 && std::filesystem::exists(file))
      throw std::runtime_error("'" + file +
                               "' was there before: give another path, or set visual_odometry/overwrite at the start");
    saveTrajectory(path, *mount_->last(), format, file);
    saved_.insert(file);
    return std::to_string(path.poses.size()) + " poses in '" + file + "'";
  }

  static constexpr double kRestPeriod = 0.05;    // s of wall time, less than a pair takes
  static constexpr double kStanding = 1.0;       // s until the images rest: subscribing anew costs a tenth (chosen)
  static constexpr double kOtherClock = 3600.0;  // s of latency, more than any slow machine has
  /// Queue of the subscriber (messages). The callback only stores them.
  static constexpr int kArrivalQueue = 20;

  ros::NodeHandle nh_;
  OdometryOutputOptions options_;
  VisualOdometryOptions reconfigured_;  // the server's
  Requests<VisualOdometryOptions> reconfigurations_;
  std::unique_ptr<ReconfigureServer> reconfigure_server_;
  std::unique_ptr<RobotTransforms> transforms_;
  std::unique_ptr<CameraMount> mount_;
  std::unique_ptr<UnusedInput> unused_;
  std::unique_ptr<ImuInput> imu_;  // none without use_imu
  std::unique_ptr<GuessInput> guesses_;
  std::unique_ptr<OdometryPublisher> publisher_;
  std::unique_ptr<OdometryDiagnostics> diagnostics_;
  ros::Subscriber pose_subscriber_;
  std::set<std::string> saved_;  // trajectories' files
  struct Resume {};
  std::atomic<int> starts_{0};  // by services
  Requests<Resume> resumes_;
  std::atomic<bool> stopping_{false};

  // Only the callbacks' thread touches these.
  FeaturesFilter filter_;
  std::optional<std::uint32_t> stream_epoch_;

  // The worker's thread touches these, and services do.
  std::mutex work_mutex_;
  std::unique_ptr<VisualOdometry> odometry_;
  std::unique_ptr<StartPose> start_;
  std::optional<AxesWatch> axes_;
  int source_restarts_ = 0, clock_steps_ = 0;
  std::optional<std::pair<std::int64_t, std::int64_t>> last_arrival_;  // stamp and arrival of the last pair, ns
  std::int64_t time_shift_ = 0;  // ns, from stamps to times of the odometry, which never jump
  int epoch_ = 0;
  bool is_tracking_ = false;  // TRACKING was reported, and no LOST since
  std::string camera_frame_;
  std::optional<std::uint32_t> processed_epoch_;
  std::optional<GuessInput::Begin> processed_;  // the last pair; with the base, if the odometry tracked then
  double moved_at_ = steadyTime();              // s: pairs were last wanted
  bool rests_ = false;                          // the input
  ros::Time corrected_at_;                      // while it rests; TF takes a stamp once
  ros::WallTimer rest_timer_;
  bool latency_reported_ = false;
  bool base_is_camera_ = false;  // the base has optical axes, those of odom are REP-105's

  std::unique_ptr<Worker<FeaturesFilter::Passed>> worker_;
  std::unique_ptr<PausableInput> input_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::VisualOdometryNodelet, nodelet::Nodelet)
