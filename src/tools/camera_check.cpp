#include "camera_check.hpp"

#include <opencv2/core.hpp>

#include "../check/calibration_check.hpp"
#include "../common/text.hpp"

namespace sdvo {

CameraCheck::CameraCheck(const PipelineOptions& options, const OfflineRun& run)
    : options_(options),
      run_(run),
      rows_(options.stereo_features.stereo.max_epipolar_residual, options.stereo_features.stereo.epipolar.max_disparity,
            RigMonitor::kReach) {}

void CameraCheck::add(const RecordedPair& pair, const StereoFeatures& features) {
  camera_ = pair.camera;
  lens_ = pair.lens;
  unrectified_ = pair.unrectified;
  ++used_;
  if (features.report.refused) {
    ++refused_;
    refusal_ = features.report.status;
  }
  rows_.add(pair.left, pair.right, pair.stamp);
  lens_check_.add(pair.camera, pair.left, pair.right, pair.stamp);
  repeats_.add(pair.left, pair.right, pair.stamp);
  images_.add(pair.left, pair.right, features.report);
  emitter_.add(pair.left);
  odometry_.add(features, run_.last());
  cv::vconcat(pair.left, pair.right, picture_);
}

void CameraCheck::addUnusable(const std::string& problem) {
  ++unusable_;
  problem_ = problem;
}

std::vector<Finding> CameraCheck::findings(const ArrivalFindings& arrivals) const {
  std::vector<Finding> findings;
  std::string fault;
  const auto append = [&](Finding finding) {
    if (!fault.empty())
      finding = {finding.step, Verdict::kOpen, "not judged: mend '" + fault + "' first", ""};
    else if (finding.verdict == Verdict::kFail)
      fault = finding.step;
    findings.push_back(finding);
  };
  append(arrivals.topics);
  append(arrivals.stamps);
  append(calibration());
  append(images_.exposure(thresholds_.min_intensity, thresholds_.max_intensity));
  append(repeats_.judge());
  append(rows_.sameMoment());
  append(odometry_.shutter());
  append(rows_.rectification());
  append(rig());
  append(lens_check_.judge());
  append(images_.texture(thresholds_.min_corners, options_.stereo_features.rig_monitor.suspicious_share));
  append(images_.blur());
  append(emitter_.judge());
  append(images_.frameRate(odometry_.rotations()));
  append(odometry_.judge());
  append(load(arrivals.rate));
  findings.push_back(arrivals.transform);  // which no other step needs
  return findings;
}

Finding CameraCheck::calibration() const {
  const std::string step = "calibration";
  if (unusable_ > 0 || used_ == 0)
    return {step, used_ == 0 && unusable_ == 0 ? Verdict::kOpen : Verdict::kFail,
            problem_.empty() ? "no pairs" : problem_,
            unusable_ > 0 ? "see docs/cameras.md, 'What a wrong camera_info looks like'" : ""};
  return checkCalibration(camera_, lens_, unrectified_);
}

Finding CameraCheck::rig() const {
  constexpr double kFew = 0.1;  // share of the pairs (chosen)
  const std::string step = "rig monitor";
  const std::string what =
      text(0, refused_, " of ", used_, " pairs refused") + (refusal_.empty() ? "" : ": " + refusal_);
  if (refused_ > kFew * used_) return {step, Verdict::kFail, what, "look at both images: sides, mounting, calibration"};
  return {step, refused_ > 0 ? Verdict::kWarn : Verdict::kOk, what, ""};
}

Finding CameraCheck::load(double rate) const {
  const std::string step = "load";
  const double share = 1e-3 * run_.cpuTime() * rate;
  const std::string what =
      text(1, run_.cpuTime(), " ms of CPU time a pair, ", 100.0 * share, " % of one processor; done after ",
           run_.time(0.5), " ms (median), ", run_.time(0.95), " ms (95 %)");
  if (share > thresholds_.max_load)
    return {step, Verdict::kWarn, what, "fewer detector/max_features, smaller images or max_rate"};
  return {step, Verdict::kOk, what, ""};
}

}  // namespace sdvo
