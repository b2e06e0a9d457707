#include "recording.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <utility>

#include "../check/stamp_check.hpp"
#include "../config/interface_options.hpp"
#include "bag_recording.hpp"
#include "stereo_descriptor_vo/data/euroc_dataset.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace fs = std::filesystem;

namespace sdvo {
namespace {

/// The rectified views.
class RectifiedEuroc : public EurocSequence {
 public:
  using EurocSequence::EurocSequence;
  const StereoCamera& camera() const { return rectification().camera(); }
  ImagePair load(int i) const { return loadRectified(i); }
};

int unpaired(const KittiSequence&) {
  return 0;
}
int unpaired(const RectifiedEuroc& sequence) {
  return sequence.unpaired();
}

Eigen::Isometry3d mountOf(const KittiSequence&) {
  return Eigen::Isometry3d::Identity();
}
Eigen::Isometry3d mountOf(const RectifiedEuroc& sequence) {
  return sequence.rectification().T_body_left();
}

/// A folder, of which every pair is usable.
template <class Sequence>
class FolderRecording : public Recording {
 public:
  template <class... Arguments>
  explicit FolderRecording(const Arguments&... arguments) : sequence_(arguments...) {}

  int size() const override { return sequence_.size(); }

  int forEach(int limit, const Use& use, const Refuse&) override {
    used_ = std::min(limit, size());
    for (int i = 0; i < used_; ++i) give(i, sequence_.stamp(i), use);
    return unpaired(sequence_);
  }

  void forEachBackwards(const Use& use) const override {
    const std::int64_t ends = sequence_.stamp(0) + sequence_.stamp(used_ - 1);
    for (int i = used_ - 1; i >= 0; --i) give(i, ends - sequence_.stamp(i), use);
  }

  std::vector<std::optional<Eigen::Isometry3d>> truth(const std::string& path,
                                                      const std::vector<std::int64_t>& stamps) const override {
    auto poses = readGroundTruth(path, stamps);
    if (fs::path(path).extension() == ".csv")
      for (auto& pose : poses)
        if (pose) *pose = *pose * mountOf(sequence_);
    return poses;
  }

  ArrivalFindings arrivals(const std::string&) const override {
    StampCheck check({});
    for (int i = 0; i < used_; ++i) {
      const double seconds = 1e-9 * static_cast<double>(sequence_.stamp(i));
      for (std::size_t input = 0; input < StampCheck::kInputs; ++input) check.note(input, sequence_.stamp(i), seconds);
      check.notePair(sequence_.stamp(i));
    }
    const RateOptions rates;
    const Finding transform{Verdict::kOpen, "a folder has none"};
    return {check.topics(rates.min_rate, rates.max_rate, ""), check.stamps(), transform, check.rate(), std::nullopt};
  }

 private:
  void give(int i, std::int64_t stamp, const Use& use) const {
    const ImagePair pair = sequence_.load(i);
    use({sequence_.camera(), pair.left, pair.right, stamp, "", ""});
  }

  const Sequence sequence_;
  int used_ = 0;
};

class JoinedRecording : public Recording {
 public:
  JoinedRecording(const std::vector<std::string>& paths, const StereoSource& source) : paths_(paths) {
    for (const std::string& path : paths) parts_.push_back(openRecording(path, source));
  }

  int size() const override {
    int size = 0;
    for (const auto& part : parts_) size += part->size();
    return size;
  }

  int forEach(int limit, const Use& use, const Refuse& refuse) override {
    int left_out = 0;
    ends_.clear();
    for (std::size_t i = 0; i < parts_.size() && limit > 0; ++i) {
      ends_.emplace_back();
      const auto use_part = [&](const RecordedPair& pair) {
        if (!ends_.back()) {
          if (i > 0 && pair.stamp <= ends_[i - 1]->second)
            throw std::runtime_error("'" + paths_[i] + "' is not later than '" + paths_[i - 1] +
                                     "': name the parts in the order of time (ls -v)");
          ends_.back() = {pair.stamp, pair.stamp};
        }
        ends_.back()->second = pair.stamp;
        --limit;
        use(pair);
      };
      left_out += parts_[i]->forEach(limit, use_part, refuse);
    }
    return left_out;
  }

  void forEachBackwards(const Use& use) const override {
    const std::int64_t all = ends_.front()->first + ends_.back()->second;
    for (std::size_t i = ends_.size(); i-- > 0;)
      parts_[i]->forEachBackwards([&](RecordedPair pair) {
        pair.stamp += all - ends_[i]->first - ends_[i]->second;
        use(pair);
      });
  }

  ArrivalFindings arrivals(const std::string& base_frame) const override {
    return parts_.front()->arrivals(base_frame);  // parts are of one driver
  }

 private:
  const std::vector<std::string> paths_;
  std::vector<std::unique_ptr<Recording>> parts_;
  std::vector<std::optional<std::pair<std::int64_t, std::int64_t>>> ends_;  ///< stamps, ns, of the parts that were used
};

}  // namespace

std::vector<std::optional<Eigen::Isometry3d>> Recording::truth(const std::string& path,
                                                               const std::vector<std::int64_t>& stamps) const {
  return readGroundTruth(path, stamps);
}

std::unique_ptr<Recording> openRecording(const std::string& path, const StereoSource& source) {
  if (!fs::exists(path)) throw std::runtime_error("there is no '" + path + "'");
  if (!fs::is_directory(path)) return std::make_unique<BagRecording>(path, source);
  if (const auto mav0 = findMav0(path))
    return std::make_unique<FolderRecording<RectifiedEuroc>>(*mav0, source.calibration, source.fov);
  for (const char* images : {"image_0", "image_1", "image_2", "image_3"})
    if (fs::is_directory(fs::path(path) / images)) return std::make_unique<FolderRecording<KittiSequence>>(path);
  throw std::runtime_error(
      "'" + path + "' is " +
      (fs::exists(fs::path(path) / "metadata.yaml") ? "a bag of ROS 2 or another" : "no recording:") +
      " folder; KITTI's (image_0, image_1, calib.txt, times.txt), EuRoC's and TUM-VI's (mav0, or cam0 "
      "and cam1) are read, and bags of ROS 1 (of a folder of bags each one: run_many)");
}

std::unique_ptr<Recording> openParts(const std::vector<std::string>& paths, const StereoSource& source) {
  if (paths.size() == 1) return openRecording(paths.front(), source);
  return std::make_unique<JoinedRecording>(paths, source);
}

}  // namespace sdvo
