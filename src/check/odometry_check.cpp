#include "odometry_check.hpp"

#include <algorithm>
#include <cmath>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

void OdometryCheck::add(const OdometryResult& result) {
  if (result.state == TrackingState::kWaiting) return;
  (result.state == TrackingState::kTracking ? tracking_ : result.state == TrackingState::kLost ? lost_ : degraded_)++;
  if (result.state != TrackingState::kTracking) ++reasons_[result.reason];
  distance_ = result.distance;
  if (std::isfinite(result.readout)) readout_ = {result.readout, result.readout_sigma};
  if (!result.has_motion) return;
  inliers_.push_back(result.inliers);
  rotations_.push_back(degreesOf(result.T_previous_current.linear()));
}

Finding OdometryCheck::judge() const {
  constexpr double kFew = 0.02, kMany = 0.2;  // chosen: shares of the pairs
  const int pairs = lost_ + degraded_ + tracking_;
  if (pairs < 2) return {Verdict::kOpen, "too few pairs"};
  std::string what = text(0, tracking_, " of ", pairs, " pairs TRACKING, ", degraded_, " DEGRADED, ", lost_, " LOST; ",
                          quantile(inliers_, 0.5), " inliers (median)") +
                     text(1, "; ", distance_, " m");
  const auto often = std::max_element(reasons_.begin(), reasons_.end(),
                                      [](const auto& a, const auto& b) { return a.second < b.second; });
  const double bad = static_cast<double>(lost_ + degraded_) / pairs;
  if (bad <= kFew && lost_ == 0) return {Verdict::kOk, what};
  return judged(static_cast<double>(lost_) / pairs > kMany, true, what,
                "most often: " + often->first + " (docs/troubleshooting.md)");
}

Finding OdometryCheck::shutter() const {
  if (!readout_) return {Verdict::kOpen, "too few pairs with a motion that changes", "turn"};
  const auto [value, sigma] = *readout_;
  const std::string what = text(1, "last row ", 1e3 * std::abs(value), " +- ", 1e3 * sigma, " ms ",
                                value > 0.0 ? "after" : "before", " the first");
  if (told_ != 0.0)
    return warnIf(RowReadout::Estimate{value - told_, sigma}.isRolling(),
                  what + text(1, ", compensated as ", 1e3 * told_, " ms"),
                  text(4, "set calibration/readout to ", value));
  return warnIf(readout_->isRolling(), what,
                text(4, "a rolling shutter, compensated once it was known: set calibration/readout to ", value,
                     ", then it is from the start"));
}

}  // namespace sdvo
