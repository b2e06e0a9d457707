#pragma once

#include <rosbag/bag.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "../check/finding.hpp"
#include "../config/pipeline_options.hpp"
#include "offline_run.hpp"
#include "recording.hpp"
#include "self_check.hpp"

namespace sdvo {

/// The left image of a pair with its features, CV_8UC3.
cv::Mat drawLeft(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result);

/// Left images of a drive with their features: twelve spread over all pairs, and the first four where tracking ends.
class DrivePictures {
 public:
  struct Picture {
    cv::Mat image;  ///< CV_8UC3
    std::string words;
  };

  explicit DrivePictures(int pairs) : pairs_(pairs) {}

  /// The next pair.
  void add(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result);

  const std::vector<Picture>& pictures() const { return pictures_; }

 private:
  static constexpr int kSpread = 12, kEnds = 4;

  int pairs_, seen_ = 0, spread_ = 0, ends_ = 0;
  std::int64_t first_stamp_ = 0;  ///< ns
  bool was_tracking_ = true;
  std::string reason_;  ///< of the last picture
  std::vector<Picture> pictures_;
};

/// States, latencies, dropped pairs and jumps in the vo_info of a recorded drive.
struct LiveRecord {
  std::array<int, 4> states{};      ///< pairs of each VoInfo::state_id
  std::vector<double> latencies;    ///< s, those known
  std::uint64_t dropped_pairs = 0;  ///< on either side
  int discontinuities = 0;          ///< of the pose
};

/// From the first topic with VoInfo in a bag; nothing without one.
std::optional<LiveRecord> readLiveRecord(const rosbag::Bag& bag);

/// All that the page of a drive shows.
struct DriveReport {
  std::string name;
  int left_out = 0;  ///< stamps without a usable pair
  PipelineOptions options;
  std::vector<CheckStep> steps;   ///< of the camera's check
  cv::Mat rows;                   ///< RowCheck::map()
  Eigen::Matrix3d R_base_camera;  ///< x ahead, y to the left, z up
  std::vector<SelfCheck> self_checks;
  std::vector<DrivePictures::Picture> pictures;
  std::vector<std::optional<Eigen::Isometry3d>> truth;  ///< of the left camera at each pair; empty: unknown
  std::optional<LiveRecord> live;
};

/// The verdict on the drive: whether it was followed, how precisely, and the camera's worst fault.
Finding judge(const DriveReport& report, const OfflineRun& run);

/// Indices of the worst one of each `step` successive pairs, so that the page shows every outage.
std::vector<std::size_t> worstOfEach(const std::vector<OfflineRun::Frame>& frames, std::size_t step);

/// The page of a drive, which needs no other file and has less than 2 MB. Throws std::runtime_error when it cannot be
/// written.
void writeDrivePage(const std::string& path, const DriveReport& report, const OfflineRun& run);

}  // namespace sdvo
