#include <atomic>
#include <boost/make_shared.hpp>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "../../check/calibration_check.hpp"
#include "../../check/image_check.hpp"
#include "../../check/mosaic_check.hpp"
#include "../../common/stamp_filter.hpp"
#include "../../common/worker.hpp"
#include "../../config/interface_options.hpp"
#include "../../messages/camera_conversions.hpp"
#include "../../messages/feature_conversions.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/image_conversions.hpp"
#include "../../messages/stamps.hpp"
#include "../diagnostics/diagnostics.hpp"
#include "../node/throttles.hpp"
#include "../synchronisation/camera_finder.hpp"
#include "../synchronisation/pair_decoder.hpp"
#include "../synchronisation/stereo_input.hpp"
#include "../transforms/transforms.hpp"
#include "robot_nodelet.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"

namespace sdvo {
namespace {

/// Whether descriptors of these options can be matched with each other. Detector and stereo options do not matter.
bool describeAlike(const FeatureExtractorOptions& a, const FeatureExtractorOptions& b) {
  const auto hash = [](FeatureExtractorOptions options) {
    OptionList list;
    options.size_curve = options.sizeCurve();
    options.size_curve.describe(list);
    options.descriptor.describe(list);
    return hashOptions(list.options());
  };
  return hash(a) == hash(b);
}

}  // namespace

/// Rectified stereo images in, depth-scaled stereo descriptors out. Images are subscribed only while somebody listens.
class StereoFeaturesNodelet : public RobotNodelet {
 public:
  ~StereoFeaturesNodelet() override {
    stopThreads();
    if (worker_) worker_->stop();
  }

 private:
  using PairFilter = StampFilter<StereoPairMessages>;

  void begin() override {
    ros::NodeHandle master_nh = addThread().serve(getNodeHandle());  // what may wait for the master
    CallbackThread& callbacks = addThread();
    nh_ = callbacks.serve(getNodeHandle());
    ros::NodeHandle private_nh = callbacks.serve(getPrivateNodeHandle());
    ros::NodeHandle slow_nh = addThread().serve(getPrivateNodeHandle());  // services
    options_.find_camera = nh_.getNamespace() != "/";                     // there it would be any camera of the robot
    loadOptions(private_nh, options_, reconfigured_);
    transport_ = std::make_unique<StereoImageTransport>(private_nh);
    extractor_ = std::make_unique<FeatureExtractor>(reconfigured_);
    pace_ = Pace(options_.max_rate);
    unused_ = std::make_unique<UnusedInput>(
        "pairs", options_.rates.max_unused,
        std::set<int>{UnusedInput::kUnpaired, UnusedInput::kPushedOut, UnusedInput::kRefused});
    arrivals_ = std::make_unique<ArrivalLog>(options_, *unused_);
    finder_ = std::make_unique<CameraFinder>(nh_.getNamespace(), nh_.resolveName("left/image_rect"),
                                             nh_.resolveName("right/image_rect"));
    worker_ = std::make_unique<Worker<PairFilter::Passed>>(
        static_cast<std::size_t>(options_.queue_size), [this](const PairFilter::Passed& passed) { process(passed); });
    if (options_.opencv_threads >= 0) cv::setNumThreads(options_.opencv_threads);
    diagnostics_ = std::make_unique<ImageDiagnostics>(nh_, private_nh, getName(), options_, *arrivals_, *unused_);
    arrivals_->pairs().noteIdle(kNobodyListens);
    input_timer_ =
        master_nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { watchInput(); });

    FeatureExtractorOptions defaults;
    reconfigure_server_ = std::make_unique<ReconfigureServer>(
        slow_nh, listOptions(reconfigured_),
        [this] { extractors_.post(std::make_unique<FeatureExtractor>(reconfigured_)); }, listOptions(defaults));

    // Called when the threads have started, and so after publisher_ is set.
    const ros::SubscriberStatusCallback on_connect = [this](const ros::SingleSubscriberPublisher&) { updateInput(); };
    publisher_ = master_nh.advertise<stereo_descriptor_vo::StereoFeatures>("stereo_features", kPublishQueue, on_connect,
                                                                           on_connect);
  }

  // In the thread that may wait for the master.

  void watchInput() {
    if (!input_) return;
    ros::master::V_TopicInfo topics;
    std::string report;
    const bool searches = options_.find_camera && finder_->isSearching(has_pairs_);
    if (searches && ros::master::getTopics(topics) && finder_->update(topics, report)) {
      NODELET_WARN_STREAM(report);
      input_.reset();
      return updateInput();
    }
    if (!report.empty()) SDVO_WARN("cameras", report);
    const double now = ros::SteadyTime::now().toSec();
    std::string problem = arrivals_->explainLoss(now);
    if (problem.empty() && !(problem = arrivals_->explainSilence(now)).empty() && ros::master::getTopics(topics))
      problem += explainUnpublished(input_->subscribedTopics(), topics);
    if (!problem.empty()) SDVO_WARN("synchronisation", problem);
  }

  void updateInput() try {
    if (publisher_.getNumSubscribers() == 0) {
      input_.reset();
      mask_subscriber_.shutdown();
      arrivals_->pairs().noteIdle(kNobodyListens);
    } else if (!input_) {
      input_ = std::make_unique<StereoInput>(
          finder_->handle(nh_), *transport_, options_, *arrivals_,
          [this](const StereoPairMessages& pair) { onPair(pair); },
          [this](ArrivalLog::Input input, const std::string& topic, const std::string& why) {
            if (input == ArrivalLog::kLeftImage) unused_->add(UnusedInput::kLate);
            onRefusal(topic, why);
          });
      XmlRpc::XmlRpcValue topics;
      for (const std::string& topic : input_->subscribedTopics()) topics[topics.valid() ? topics.size() : 0] = topic;
      setParam(getPrivateNodeHandle(), kInputTopics, topics);
      mask_subscriber_ =
          nh_.subscribe<sensor_msgs::Image>("left/mask", 1, [this](const sensor_msgs::ImageConstPtr& m) { onMask(m); });
    }
  } catch (const std::exception& e) {
    NODELET_ERROR_STREAM("cannot subscribe to the images: " << e.what());
  }

  // In the threads of the images.

  void onRefusal(const std::string& topic, const std::string& why) {
    SDVO_ERROR(topic, topic << ": a message is not used: " << why);
  }

  /// A mask is used until the next one comes, whatever its stamp.
  void onMask(const sensor_msgs::ImageConstPtr& message) try {
    masks_.post(ros_conversions::toGrey(message).clone());
  } catch (const std::exception& e) {
    onRefusal(nh_.resolveName("left/mask"), e.what());
  }

  void onPair(const StereoPairMessages& pair) {
    const ros::Time stamp = pair.left_image->header.stamp;
    has_pairs_ = true;
    const std::uint64_t late = filter_.dropped();
    for (PairFilter::Passed& passed : filter_.add(pair, nanoseconds(stamp), nanoseconds(ros::Time::now())))
      if (pace_.isDue(nanoseconds(passed.item.left_image->header.stamp)) && !worker_->push(std::move(passed)))
        unused_->add(UnusedInput::kPushedOut);
    unused_->add(UnusedInput::kLate, filter_.dropped() - late);
    if (filter_.dropped() > late)
      SDVO_WARN("late", "a pair near " << stamp << " is late or has a wrong stamp: dropped (" << filter_.dropped()
                                       << " so far); if this goes on, check the driver's stamps");
  }

  void takeOverOptions() {
    auto pending = extractors_.take();
    if (!pending) return;
    const bool same_rows = describeAlike(extractor_->options(), (*pending)->options());
    extractor_ = *std::move(pending);
    if (same_rows) return;
    ++stream_epoch_;  // descriptors of another kind or size match none of before
    NODELET_INFO("reconfigured: descriptors of another kind or size, so a new stream begins (epoch + 1)");
  }

  /// In the worker's thread.
  void process(const PairFilter::Passed& passed) try {
    const StereoPairMessages& pair = passed.item;
    const WorkLoad::Item work(diagnostics_->load());
    diagnostics_->load().noteDropped(unused_->count(UnusedInput::kPushedOut));
    takeOverOptions();
    const ros::Time stamp = pair.left_image->header.stamp;
    if (std::exchange(clock_steps_, passed.clock_steps) != passed.clock_steps && ros::Time::isSimTime()) {
      NODELET_WARN_STREAM("the clock jumped back to " << stamp << ": a new stream begins (epoch + 1)");
      ++stream_epoch_;
    }
    if (const auto mask = masks_.take()) mask_ = *mask;
    const DecodedPair decoded = decoder_.decode(pair);
    if (decoded.new_range && throttle_.allows("mono16"))
      NODELET_INFO_STREAM("mono16 images: " << decoder_.greyRange().black << " to " << decoder_.greyRange().white
                                            << " are black to white");
    const auto [left, right] = mosaic_.add(decoded.left, decoded.right);
    StereoFeatures features = extractor_->extract(decoded.camera, left, right, nanoseconds(stamp), mask_, last_report_);
    last_report_ = features.report;
    if (options_.pairing.approximate_sync) features.right_delay = secondsBetween(stamp, pair.right_image->header.stamp);
    // After the extraction, which throws if the calibration does not fit the images: such a one begins no new stream.
    const std::string unrectified = ros_conversions::whyUnrectified(*pair.left_info, *pair.right_info);
    noteCamera(decoded.camera, pair.left_info->distortion_model, unrectified);
    if (emitter_.judge().verdict == Verdict::kOpen) {  // until the camera has moved enough
      emitter_.add(left);
      warnOf("emitter", emitter_.judge());
    }
    if (features.report.refused && !unrectified.empty()) features.report.status = unrectified;
    repeats_.add(left, right, nanoseconds(stamp));
    if (!repeats_.problem().empty() && (features.report.refused || features.report.status.empty()))
      features.report.status = repeats_.problem();
    if (const std::string problem = mosaic_.problem(); !problem.empty()) {
      if (!std::exchange(mosaic_found_, true)) warnOf("mosaic", mosaic_.judge());
      features.report.status = problem;
    }

    diagnostics_->note(features);
    reportRig(features, stamp);
    const auto message = boost::make_shared<stereo_descriptor_vo::StereoFeatures>(
        ros_conversions::toMessage(features, extractor_->sizeCurve(left.size())));
    message->header.stamp = stamp;
    message->header.frame_id = ros_conversions::cleanFrameId(pair.left_image->header.frame_id);
    message->stream_epoch = stream_epoch_;
    message->dropped_pairs = unused_->sum();
    publisher_.publish(message);
    unused_->noteUsed();
  } catch (const std::exception& e) {
    unused_->add(UnusedInput::kRefused);
    diagnostics_->noteFailure(e.what());
    const std_msgs::Header& header = passed.item.left_image->header;
    SDVO_ERROR(e.what(), "pair at " << header.stamp << " of " << header.frame_id << " skipped: " << e.what());
  }

  void noteCamera(const StereoCamera& camera, const std::string& lens, const std::string& unrectified) {
    const PairDecoder::Change change = decoder_.accept(camera);
    if (change == PairDecoder::Change::kNone) return;
    warnOf("calibration", checkCalibration(camera, lens, unrectified));
    if (change == PairDecoder::Change::kFirst) return;
    ++stream_epoch_;
    SDVO_WARN("camera_info", "camera_info changed: a new stream begins (epoch + 1; " << stream_epoch_ << " so far)");
  }

  void warnOf(const char* step, const Finding& finding) {
    if (finding.isFault()) NODELET_WARN_STREAM(step << ": " << finding.text());
  }

  /// Reports changes of the rig monitor's verdict. A pair without features (dark) has none.
  void reportRig(const StereoFeatures& features, const ros::Time& stamp) {
    const bool refused = features.report.refused;
    const bool is_wrong = refused || features.report.along_rows;
    if (is_wrong == rig_is_wrong_ || (!is_wrong && features.count() == 0) || !throttle_.allows("rig")) return;
    rig_is_wrong_ = is_wrong;
    if (refused)
      NODELET_WARN_STREAM("pairs from " << stamp << " on are refused: " << features.report.status);
    else if (is_wrong)
      NODELET_WARN_STREAM("pairs from " << stamp << " on are matched along their rows: " << features.report.status
                                        << " Calibrate the cameras again");
    else
      NODELET_WARN_STREAM("rows of left and right agree again: pairs from " << stamp << " on are used");
  }

  static constexpr int kPublishQueue = 10;
  static constexpr const char* kNobodyListens = "nobody listens to stereo_features";

  ros::NodeHandle nh_;
  StereoInputOptions options_;
  FeatureExtractorOptions reconfigured_;  // the server's
  ros::Publisher publisher_;
  ros::WallTimer input_timer_;
  std::atomic<bool> has_pairs_{false};
  std::unique_ptr<UnusedInput> unused_;
  std::unique_ptr<ArrivalLog> arrivals_;
  std::unique_ptr<ImageDiagnostics> diagnostics_;

  Requests<std::unique_ptr<FeatureExtractor>> extractors_;
  Requests<cv::Mat> masks_;
  std::unique_ptr<ReconfigureServer> reconfigure_server_;

  PairFilter filter_;  // only the input's callback touches it, and the next
  Pace pace_{0.0};

  // Only the worker's thread touches these.
  std::unique_ptr<FeatureExtractor> extractor_;
  std::unique_ptr<RobotTransforms> transforms_;  // once P lacks a baseline
  PairDecoder decoder_{[this](const std::string& parent, const std::string& child, std::string& problem) {
    if (!transforms_)
      transforms_ = std::make_unique<RobotTransforms>(nh_, std::nullopt, TransformPublisher::tagOf(getName()),
                                                      [this](const std::string& why) { NODELET_WARN_STREAM(why); });
    return transforms_->find(parent, child, problem);
  }};
  ExtractionReport last_report_;
  RepeatCheck repeats_;
  cv::Mat mask_;  // of the topic; empty: none has come
  EmitterCheck emitter_;
  MosaicCheck mosaic_;
  bool mosaic_found_ = false;
  int clock_steps_ = 0;
  std::uint32_t stream_epoch_ = 0;
  bool rig_is_wrong_ = false;  // as reported last

  std::unique_ptr<Worker<PairFilter::Passed>> worker_;
  std::unique_ptr<StereoImageTransport> transport_;

  // Only the thread that may wait for the master touches these.
  std::unique_ptr<CameraFinder> finder_;
  std::unique_ptr<StereoInput> input_;
  ros::Subscriber mask_subscriber_;
};

}  // namespace sdvo

PLUGINLIB_EXPORT_CLASS(sdvo::StereoFeaturesNodelet, nodelet::Nodelet)
