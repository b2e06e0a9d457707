#include "recording.hpp"

#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "../common/stamp_filter.hpp"
#include "../config/interface_options.hpp"
#include "../data/euroc_dataset.hpp"
#include "../messages/stamps.hpp"
#include "camera_input.hpp"
#include "pair_reader.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace fs = std::filesystem;

namespace sdvo {
namespace {

/// A folder, of which every pair is usable. Those of EuRoC have raw images, and poses of a body.
template <class Sequence>
class FolderRecording : public Recording {
  static constexpr bool kIsEuroc = std::is_same_v<Sequence, EurocSequence>;

 public:
  template <class... Arguments>
  explicit FolderRecording(const Arguments&... arguments) : sequence_(arguments...) {}

  int size() const override { return sequence_.size(); }

  int forEach(int limit, const Use& use, const Refuse&) override {
    used_ = std::min(limit, size());
    for (int i = 0; i < used_; ++i) give(i, sequence_.stamp(i), use);
    return sequence_.unpaired();
  }

  void forEachBackwards(const Use& use) const override {
    const std::int64_t ends = sequence_.stamp(0) + sequence_.stamp(used_ - 1);
    for (int i = used_ - 1; i >= 0; --i) give(i, ends - sequence_.stamp(i), use);
  }

  std::vector<std::optional<Eigen::Isometry3d>> truth(const std::string& path,
                                                      const std::vector<std::int64_t>& stamps) const override {
    auto poses = Recording::truth(path, stamps);
    if constexpr (kIsEuroc)
      for (auto& pose : poses)
        if (pose && fs::path(path).extension() == ".csv") *pose = *pose * sequence_.rectification().T_body_left();
    return poses;
  }

  ArrivalFindings arrivals(const std::string&) const override {
    UnusedInput unused("pairs", 1.0);
    ArrivalLog log(StereoInputOptions(), unused, std::numeric_limits<double>::infinity());
    for (int i = 0; i < used_; ++i) {
      const std::int64_t stamp = sequence_.stamp(i);
      const double seconds = 1e-9 * static_cast<double>(stamp);
      for (const auto input :
           {ArrivalLog::kLeftImage, ArrivalLog::kRightImage, ArrivalLog::kLeftInfo, ArrivalLog::kRightInfo})
        log.note(input, stamp, seconds);
      log.notePair(stamp, stamp, seconds);
    }
    return log.findings({Verdict::kOpen, "a folder has none"});
  }

  std::set<std::int64_t> leftStamps() const override {
    std::set<std::int64_t> stamps;
    for (int i = 0; i < size(); ++i) stamps.insert(sequence_.stamp(i));
    return stamps;
  }

  std::size_t firstNumber() const override {
    if constexpr (kIsEuroc) return 0;
    else return static_cast<std::size_t>(sequence_.first());
  }

 private:
  void give(int i, std::int64_t stamp, const Use& use) const {
    const ImagePair pair = sequence_.loadRectified(i);
    use({sequence_.camera(), pair.left, pair.right, stamp, "", ""});
  }

  const Sequence sequence_;
  int used_ = 0;
};

/// The stereo pairs of a bag, or of the parts of one. Only the current images and those that wait for a partner are in
/// memory.
class BagRecording : public Recording {
 public:
  /// Throws std::runtime_error where a topic is missing.
  BagRecording(const std::vector<std::string>& parts, const StereoSource& source)
      : fov_(source.fov), pairing_(source.pairing) {
    ros::Time begin;  // of the part before; its end may be a little later than the next one's begin
    for (const std::string& part : parts) {
      openBag(part, *bags_.emplace_back(std::make_unique<rosbag::Bag>()));
      ofBag(part, [&] {
        const ros::Time before = std::exchange(begin, rosbag::View(*bags_.back()).getBeginTime());
        if (begin <= before)
          throw std::runtime_error("'" + part + "' is not later than " + names_ +
                                   ": name the parts in the order of time (ls -v)");
      });
      names_ += (names_.empty() ? "'" : ", '") + part + "'";
    }
    ofBag(parts.front(), [&] {
      topics_ = topicsIn(*bags_.front(), source);
      rosbag::View images(*bags_.front(), rosbag::TopicQuery(topics_[0]));
      if (source.calibration.empty() || images.size() == 0) return;
      const auto image = readStereoMessage(*images.begin(), topics_).image;
      infos_ = infosOf(source, cv::Size(static_cast<int>(image->width), static_cast<int>(image->height)));
    });
  }

  int size() const override {
    rosbag::View view;
    for (const auto& bag : bags_) view.addQuery(*bag, rosbag::TopicQuery(topics_[0]));
    return static_cast<int>(view.size());
  }

  int forEach(int limit, const Use& use, const Refuse& refuse) override try {
    return useAll(limit, use, refuse);
  } catch (const rosbag::BagException& e) {
    for (const auto& bag : bags_) refuseWhatIsWritten(bag->getFileName());
    throw std::runtime_error(names_ + " cannot be read: " + e.what() + ". Is it whole? rosbag check " + names_);
  }

  void forEachBackwards(const Use& use) const override {
    PairReader reader(topics_, fov_, finder());
    const std::int64_t ends = used_.front().stamp + used_.back().stamp;
    for (auto pair = used_.rbegin(); pair != used_.rend(); ++pair) {
      StereoPairMessages messages = pair->messages;
      messages.left_image = readStereoMessage(*pair->images[0], topics_).image;
      messages.right_image = readStereoMessage(*pair->images[1], topics_).image;
      RecordedPair mirrored = reader.read(messages, ends - pair->stamp);
      mirrored.right_delay = -pair->right_delay;
      use(mirrored);
    }
  }

  ArrivalFindings arrivals(const std::string& base_frame) const override { return input_->findings(base_frame, true); }
  std::set<std::int64_t> leftStamps() const override { return input_->leftStamps(); }

 private:
  ros_conversions::FindTransform finder() const {
    return [this](const std::string& parent, const std::string& child, std::string& problem) {
      return input_->find(parent, child, problem);
    };
  }

  int useAll(int limit, const Use& use, const Refuse& refuse) {
    StampFilter<ArrivedPair> filter;
    PairReader reader(topics_, fov_, finder());
    int refused = 0;
    std::string problem;
    used_.clear();
    const auto isEnough = [&] { return static_cast<int>(used_.size()) == limit; };
    const auto process = [&](const ArrivedPair& pair) {
      try {
        RecordedPair read = reader.read(pair.messages, pair.stamp);
        read.right_delay = pair.right_delay;
        use(read);
        used_.push_back(pair);
        used_.back().messages.left_image = used_.back().messages.right_image = nullptr;
      } catch (const std::invalid_argument& e) {
        ++refused;
        problem = e.what();
        if (refuse) refuse(problem);
      }
    };
    input_ = std::make_unique<CameraInput>(topics_, infos_, pairing_, [&](const ArrivedPair& pair) {
      for (const auto& passed : filter.add(pair, pair.stamp, nanoseconds(pair.complete))) {
        if (passed.source_restarts > 0 && !refuse)
          throw std::runtime_error(
              "stamps jump back for good: these are several recordings, one bag for each is needed");
        if (passed.source_restarts == 0 && !isEnough()) process(passed.item);
      }
    });

    for (const auto& bag : bags_)  // may come after the first pairs
      for (const rosbag::MessageInstance& instance : rosbag::View(*bag, rosbag::TopicQuery("/tf_static")))
        input_->add(instance);
    std::vector<std::string> wanted(topics_.begin(), topics_.end());
    wanted.emplace_back("/tf");
    rosbag::View view;
    for (const auto& bag : bags_) {
      view.addQuery(*bag, rosbag::TopicQuery(wanted));
      view.addQuery(*bag, rosbag::TypeQuery(ros::message_traits::datatype<nav_msgs::Odometry>()));  // name the base
    }
    for (auto instance = view.begin(); instance != view.end() && !isEnough(); ++instance) input_->add(*instance);
    if (used_.empty() && !refuse)
      throw std::runtime_error(names_ + ": no pair can be used: " + (problem.empty() ? input_->problem() : problem));
    return input_->unused() + static_cast<int>(filter.dropped()) + refused;
  }

  const double fov_;
  std::optional<StereoInfos> infos_;  ///< in place of those of the bag
  const PairingOptions pairing_;
  std::vector<std::unique_ptr<rosbag::Bag>> bags_;
  std::string names_;  ///< of the bags, in quotes
  StereoTopics topics_;
  std::vector<ArrivedPair> used_;       ///< by the last forEach(); their images are in the bag alone
  std::unique_ptr<CameraInput> input_;  ///< of the last forEach()
};

}  // namespace

std::vector<std::optional<Eigen::Isometry3d>> Recording::truth(const std::string& path,
                                                               const std::vector<std::int64_t>& stamps) const {
  const std::set<std::int64_t> all = leftStamps();
  std::vector<std::size_t> numbers;
  for (const std::int64_t stamp : stamps)
    numbers.push_back(static_cast<std::size_t>(std::distance(all.begin(), all.find(stamp))));
  return readGroundTruth(path, stamps, numbers, firstNumber());
}

std::unique_ptr<Recording> openRecording(const std::vector<std::string>& parts, const StereoSource& source) {
  for (const std::string& part : parts)
    if (!fs::exists(part)) throw std::runtime_error("there is no '" + part + "'");
  const std::string& path = parts.front();
  if (parts.size() > 1 || !fs::is_directory(path)) return std::make_unique<BagRecording>(parts, source);
  if (const auto mav0 = findMav0(path))
    return std::make_unique<FolderRecording<EurocSequence>>(*mav0, source.calibration, source.fov);
  if (isKittiLayout(path))
    return std::make_unique<FolderRecording<KittiSequence>>(
        path, KittiCameras::kAny, KittiSequence::Override{source.calibration, source.fov, source.rate});
  throw std::runtime_error(
      "'" + path + "' is " +
      (fs::exists(fs::path(path) / "metadata.yaml") ? "a bag of ROS 2 or another" : "no recording:") +
      " folder. Folders that are read (docs/tools.md) have mav0, or cam0 and cam1 (EuRoC, TUM-VI), or " +
      kittiLayouts() + ". Bags of ROS 1 are read, too (of a folder of bags each one: run_many)");
}

}  // namespace sdvo
