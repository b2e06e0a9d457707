#include "offline_run.hpp"

#include <algorithm>
#include <ctime>
#include <future>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "../common/statistics.hpp"
#include "../common/stopwatch.hpp"
#include "../data/text_file.hpp"
#include "../matching/patch_alignment.hpp"

namespace sdvo {
namespace {

double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Row by row, 36 numbers.
void writeCovariance(std::ostream& file, const Matrix6d& covariance) {
  for (int i = 0; i < 36; ++i) file << "," << covariance(i / 6, i % 6);
}

/// A text as a field of a CSV that needs no quotes.
std::string withoutCommas(std::string text) {
  std::replace(text.begin(), text.end(), ',', ';');
  return text;
}

}  // namespace

OfflineRun::OfflineRun(const PipelineOptions& options)
    : extractor_(options.stereo_features), odometry_(options.visual_odometry) {
  const int side = options.stereo_features.patch.layout().side;
  const std::string complaint = alignmentComplaint(side);
  if (!complaint.empty()) throw std::invalid_argument(complaint);
}

StereoFeatures OfflineRun::process(const StereoCamera& camera, const cv::Mat& left, const cv::Mat& right,
                                   std::int64_t stamp, double right_delay) {
  processBeside(camera, left, right, stamp, right_delay);
  return *finish();
}

void OfflineRun::processBeside(const StereoCamera& camera, const cv::Mat& left, const cv::Mat& right,
                               std::int64_t stamp, double right_delay) {
  const double cpu_before = cpuSeconds();
  Stopwatch stopwatch;
  // The extraction stays in this thread, which has its buffers.
  const std::optional<Extracted> before = std::exchange(waiting_, std::nullopt);
  std::future<void> odometry;
  if (before) odometry = std::async(std::launch::async, [&] { track(*before); });
  const ExtractionReport last = before            ? before->features.report
                                : frames_.empty() ? ExtractionReport()
                                                  : frames_.back().extraction;
  const auto [grey_left, grey_right] = mosaic_.add(left, right);
  Extracted pair{extractor_.extract(camera, grey_left, grey_right, stamp, cv::Mat(), last), 0.0};
  if (!mosaic().empty()) pair.features.report.status = mosaic();
  if (odometry.valid()) odometry.get();
  pair.features.right_delay = right_delay;
  pair.time = stopwatch.lap();
  waiting_ = std::move(pair);
  cpu_time_ += cpuSeconds() - cpu_before;
}

std::optional<StereoFeatures> OfflineRun::finish() {
  const double cpu_before = cpuSeconds();
  Stopwatch stopwatch;
  std::optional<Extracted> last = std::exchange(waiting_, std::nullopt);
  if (!last) return std::nullopt;
  track(*last);
  frames_.back().total_time += stopwatch.lap();
  cpu_time_ += cpuSeconds() - cpu_before;
  return std::move(last->features);
}

void OfflineRun::processFeatures(const StereoFeatures& features) {
  track({features, 0.0});
}

void OfflineRun::track(const Extracted& pair) {
  Frame frame{odometry_.update(pair.features), pair.features.report, pair.time};
  if (!frames_.empty()) std::vector<FeatureFlow>().swap(frames_.back().odometry.flow);  // by far the largest part of it
  frames_.push_back(std::move(frame));
}

int OfflineRun::pairsWithoutPose() const {
  return static_cast<int>(
      std::count_if(frames_.begin(), frames_.end(), [](const Frame& f) { return !f.odometry.has_pose; }));
}

int OfflineRun::discontinuities() const {
  return frames_.empty() ? 0 : frames_.back().odometry.epoch - frames_.front().odometry.epoch;
}

double OfflineRun::distance() const {
  return frames_.empty() ? 0.0 : frames_.back().odometry.distance;
}

PairTimes OfflineRun::times() const {
  std::vector<double> times;
  for (const Frame& frame : frames_) times.push_back(1e3 * frame.total_time);
  const double pairs = static_cast<double>(std::max<std::size_t>(frames_.size(), 1));
  return {quantile(times, 0.5), quantile(times, 0.95), 1e3 * cpu_time_ / pairs};
}

Trajectory OfflineRun::poses() const {
  Trajectory poses;
  for (const auto& [odometry, extraction, total_time] : frames_) {
    if (odometry.has_pose)
      poses.push_back(odometry.T_origin_camera);
    else
      poses.push_back(poses.empty() ? Eigen::Isometry3d::Identity() : poses.back());
  }
  return poses;
}

StampedTrajectory OfflineRun::stamped(const Trajectory& poses) const {
  StampedTrajectory trajectory;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (!frames_[i].odometry.has_pose) continue;
    trajectory.stamps.push_back(frames_[i].odometry.stamp);
    trajectory.poses.push_back(poses.at(i));
  }
  return trajectory;
}

void OfflineRun::writeTiming(const std::string& path) const {
  std::ostringstream file;
  file << "frame,total_ms,detect_ms,stereo_ms,describe_ms,match_ms,motion_ms,detected,features,matches,inliers,rms_px,"
          "coverage,right_delay_ms,right_delay_sigma_ms,readout_ms,readout_sigma_ms,state,reason\n";
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const auto& [odometry, extraction, total_time] = frames_[i];
    file << i << "," << 1e3 * total_time << "," << 1e3 * extraction.detect_time << "," << 1e3 * extraction.stereo_time
         << "," << 1e3 * extraction.describe_time << "," << 1e3 * odometry.match_time << ","
         << 1e3 * odometry.motion_time << "," << extraction.detected << "," << odometry.features << ","
         << odometry.matches << "," << odometry.inliers << "," << odometry.rms << "," << odometry.coverage << ","
         << 1e3 * odometry.right_delay << "," << 1e3 * odometry.right_delay_sigma << "," << 1e3 * odometry.readout
         << "," << 1e3 * odometry.readout_sigma << "," << toString(odometry.state) << ","
         << withoutCommas(odometry.reason) << "\n";
  }
  writeTextFile(path, file.str());
}

void OfflineRun::writeStates(const std::string& path) const {
  std::ostringstream file;
  file << "frame,stamp_ns,state,epoch,has_pose,has_motion";
  for (const char* name : {"motion", "pose"})
    for (int i = 0; i < 36; ++i) file << "," << name << "_" << i / 6 << i % 6;
  file << ",reason\n"                                                    // which stands last, for it may hold commas
       << std::setprecision(std::numeric_limits<double>::max_digits10);  // a covariance stays positive definite
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const OdometryResult& odometry = frames_[i].odometry;
    file << i << "," << odometry.stamp << "," << toString(odometry.state) << "," << odometry.epoch << ","
         << odometry.has_pose << "," << odometry.has_motion;
    writeCovariance(file, odometry.motion_covariance);
    writeCovariance(file, odometry.pose_covariance);
    file << "," << odometry.reason << "\n";
  }
  writeTextFile(path, file.str());
}

}  // namespace sdvo
