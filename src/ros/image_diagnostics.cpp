#include "image_diagnostics.hpp"

#include <algorithm>
#include <utility>

namespace sdvo {

using Level = WallUpdater::Level;

ImageDiagnostics::ImageDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                                   const StereoInputOptions& options)
    : thresholds_(options.thresholds),
      input_("pairs", nh.resolveName("left/image_rect") + " and " + nh.resolveName("right/image_rect"),
             options.max_silence, options.rates),
      load_(options.thresholds.max_load),
      updater_(nh, private_nh, name) {
  updater_.add("input rate", &input_, &InputMonitor::diagnose);
  updater_.add("synchronisation", this, &ImageDiagnostics::diagnoseSynchronisation);
  updater_.add("exposure", this, &ImageDiagnostics::diagnoseExposure);
  updater_.add("features", this, &ImageDiagnostics::diagnoseFeatures);
  updater_.add("load", &load_, &WorkLoad::diagnose);
}

void ImageDiagnostics::notePair(double gap) {
  input_.note();
  const std::lock_guard<std::mutex> lock(mutex_);
  largest_gap_ = std::max(largest_gap_, gap);
}

void ImageDiagnostics::note(const StereoFeatures& features) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = features.report;
  last_count_ = features.count();
  ++pairs_;
  refused_pairs_ += features.report.refused;
}

void ImageDiagnostics::noteFailure(const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  failure_ = why;
}

void ImageDiagnostics::noteUnused(std::uint64_t refused, std::uint64_t out_of_order) {
  const std::lock_guard<std::mutex> lock(mutex_);
  refused_ = refused;
  out_of_order_ = out_of_order;
}

/// Without input there is nothing to say; "input rate" tells why.
bool ImageDiagnostics::isIdle(Status& status) const {
  const auto silence = input_.silence();
  if (silence) status.summary(Level::OK, "no pairs");
  return silence.has_value();
}

void ImageDiagnostics::diagnoseSynchronisation(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double gap = std::exchange(largest_gap_, 0.0);
  const std::uint64_t unused = refused_ + out_of_order_;
  status.addf("largest gap [ms]", "%.2f", 1e3 * gap);
  status.add("refused messages", refused_);
  status.add("late or with wrong stamps", out_of_order_);
  const std::uint64_t lately = unused - std::exchange(reported_, unused);
  if (isIdle(status)) return;
  if (gap > thresholds_.max_gap)
    status.summaryf(Level::WARN, "left and right are %.1f ms apart: are the cameras triggered together?", 1e3 * gap);
  else if (lately > 0)
    status.summaryf(Level::WARN, "%d messages were late or had wrong stamps: check the driver's stamps",
                    static_cast<int>(lately));
  else
    status.summary(Level::OK, "left and right belong together");
}

void ImageDiagnostics::diagnoseExposure(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (isIdle(status) || !last_) return;
  const double left = last_->mean_intensity[0], right = last_->mean_intensity[1];
  status.addf("mean grey level", "%.1f left, %.1f right", left, right);
  status.addf("sharpness [grey levels a px]", "%.2f left, %.2f right", last_->sharpness[0], last_->sharpness[1]);
  if (std::min(left, right) < thresholds_.min_intensity)
    status.summaryf(Level::WARN, "too dark, expose longer or add light: mean grey levels of %.0f and %.0f", left,
                    right);
  else if (std::max(left, right) > thresholds_.max_intensity)
    status.summaryf(Level::WARN, "too bright, expose less: mean grey levels of %.0f and %.0f", left, right);
  else
    status.summaryf(Level::OK, "mean grey levels of %.0f and %.0f", left, right);
}

void ImageDiagnostics::diagnoseFeatures(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::string failure = std::exchange(failure_, "");
  const int pairs = std::exchange(pairs_, 0), refused = std::exchange(refused_pairs_, 0);
  if (isIdle(status)) return;
  status.add("corners", last_ ? last_->detected : 0);
  status.add("features", last_count_);
  status.add("refused pairs, of the last second", std::to_string(refused) + " of " + std::to_string(pairs));
  if (!failure.empty())
    status.summary(Level::ERROR, failure);
  else if (refused > 0)
    status.summary(Level::ERROR, "left and right are not a rectified pair: " + last_->status);
  else if (last_ && last_->detected < thresholds_.min_corners)
    status.summaryf(Level::WARN, "only %d corners: little texture, darkness, or out of focus?", last_->detected);
  else if (last_ && !last_->status.empty())
    status.summary(Level::WARN, last_->status);
  else
    status.summaryf(Level::OK, "%d features", last_count_);
}

}  // namespace sdvo
