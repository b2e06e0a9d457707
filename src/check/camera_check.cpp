#include "camera_check.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "../common/text.hpp"
#include "../front_end/rig_monitor.hpp"
#include "calibration_check.hpp"

namespace sdvo {

CameraCheck::CameraCheck(const PipelineOptions& options)
    : options_(options),
      rows_(options.stereo_features.stereo.max_epipolar_residual, options.stereo_features.stereo.epipolar.max_disparity,
            RigMonitor::kReach),
      odometry_(options.visual_odometry.calibration.readout) {}

void CameraCheck::add(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result) {
  camera_ = pair.camera;
  lens_ = pair.lens;
  unrectified_ = pair.unrectified;
  refusals_.add(features.report);
  if (const auto corners = corner_pairs_.add(pair.left, pair.right, pair.stamp)) {
    rows_.add(*corners);
    lens_check_.add(pair.camera, *corners);
  }
  mosaic_.add(pair.left, pair.right);
  repeats_.add(pair.left, pair.right, pair.stamp);
  focus_.add(pair.left, pair.right);
  images_.add(pair.left, pair.right, features.report);
  emitter_.add(pair.left);
  odometry_.add(result);
  if (result.state == TrackingState::kTracking && result.has_motion) motions_.push_back(result.T_previous_current);
  cv::hconcat(pair.left, pair.right, picture_);
}

void CameraCheck::addUnusable(const std::string& problem) {
  ++unusable_;
  problem_ = problem;
}

std::vector<CheckStep> CameraCheck::steps(const ArrivalFindings& arrivals, const PairTimes& times) const {
  constexpr double kFewRefused = 0.1;  // share of the pairs (chosen)
  const Finding odometry = odometry_.judge(), frame_rate = images_.frameRate(odometry_.rotations());
  std::vector<CheckStep> steps = {
      {"topics", arrivals.topics},
      {"stamps", arrivals.stamps},
      {"calibration", calibration()},
      {"exposure", images_.exposure(thresholds_.min_intensity, thresholds_.max_intensity)},
      {"mosaic", mosaic_.judge()},
      {"repeats", repeats_.judge()},
      {"focus", focus_.judge()},
      {"same moment", rows_.sameMoment()},
      {"shutter", odometry_.shutter()},
      {"rectification", rows_.rectification()},
      {"refused pairs", refusals_.judge(kFewRefused)},
      {"lens", lens_check_.judge()},
      {"texture", images_.texture(thresholds_.min_corners, options_.stereo_features.rig_monitor.suspicious_share)},
      {"motion blur", images_.blur()},
      {"emitter", emitter_.judge()},
      {"frame rate",
       odometry.isFault() ? frame_rate : frame_rate.asWarning()},  // a rate that is followed does not fail
      {"odometry", odometry},
      {"load", checkLoad(1e-3 * times.cpu * arrivals.rate, thresholds_.max_load, ", " + times.words())}};
  const auto fault = std::find_if(steps.begin(), steps.end(),
                                  [](const CheckStep& step) { return step.finding.verdict == Verdict::kFail; });
  for (auto later = fault; later != steps.end(); ++later)
    if (later != fault) later->finding = {Verdict::kOpen, "not judged: mend '" + fault->name + "' first"};
  steps.push_back({"TF", arrivals.transform});  // which only the last step needs
  steps.push_back({"mount", mount(arrivals.T_base_camera)});
  return steps;
}

Finding CameraCheck::calibration() const {
  if (unusable_ > 0) return {Verdict::kFail, problem_, "see docs/cameras.md, 'What a wrong camera_info looks like'"};
  if (refusals_.pairs() == 0) return {Verdict::kOpen, "no pairs"};
  return checkCalibration(camera_, lens_, unrectified_);
}

cv::Mat CameraCheck::picture() const {
  constexpr int kLines = 8;
  if (picture_.empty()) return {};
  cv::Mat drawn;
  cv::cvtColor(picture_, drawn, cv::COLOR_GRAY2BGR);
  for (int line = 1; line < kLines; ++line) {
    const int row = line * drawn.rows / kLines;
    cv::line(drawn, {0, row}, {drawn.cols - 1, row}, {0, 200, 255});
  }
  return drawn;
}

/// A fault only of a base that is said to drive on a floor: a hand or a rotor tilts others.
Finding CameraCheck::mount(const std::optional<Eigen::Isometry3d>& T_base_camera) const {
  if (!T_base_camera) return {Verdict::kOpen, "no mount is known"};
  MountCheck check;
  for (const Eigen::Isometry3d& motion : motions_) check.add(*T_base_camera, motion);
  const PlanarOptions& floor = options_.visual_odometry.planar;
  const Finding finding = check.judge(floor.planar_tilt_sigma);
  if (floor.planar || !finding.isFault()) return finding;
  return {Verdict::kOk, finding.what + ", which counts if it drives on a floor (planar)"};
}

}  // namespace sdvo
