#include "image_check.hpp"

#include <algorithm>
#include <cmath>

#include "../common/quantile.hpp"
#include "../common/text.hpp"

namespace sdvo {

void ImageCheck::add(const cv::Mat& left, const cv::Mat& right, const ExtractionReport& report) {
  constexpr double kWhite = 250.0;  // grey levels
  dark_.push_back(std::min(report.mean_intensity[0], report.mean_intensity[1]));
  bright_.push_back(std::max(report.mean_intensity[0], report.mean_intensity[1]));
  const double white = cv::countNonZero(left > kWhite) + cv::countNonZero(right > kWhite);
  saturated_.push_back(white / static_cast<double>(left.total() + right.total()));
  corners_.push_back(report.detected);
  matched_.push_back(report.detected > 0 ? static_cast<double>(report.stereo_matched) / report.detected : 0.0);

  CoarseView view(left);
  if (!view_.empty() && view_.size() == view.size()) {
    if (const auto motion = view.motionSince(view_)) {
      moved_.push_back(std::hypot(motion->x, motion->y));
      sharpness_.push_back(report.sharpness[0]);
    } else {
      ++lost_views_;
    }
  }
  view_ = std::move(view);
}

Finding ImageCheck::exposure(double min_intensity, double max_intensity) const {
  constexpr double kMuchWhite = 0.25;  // share of the pixels; chosen: a quarter of the view is blind then
  const std::string step = "exposure";
  const double dark = quantile(dark_, 0.1), bright = quantile(bright_, 0.9), white = quantile(saturated_, 0.9);
  const std::string what = text(0, "mean grey level ", dark, " to ", bright, ", ", 100.0 * white, " % white");
  if (bright < min_intensity || dark < min_intensity)
    return {step, bright < min_intensity ? Verdict::kFail : Verdict::kWarn, what,
            "too dark: light, longer exposure or more gain"};
  if (bright > max_intensity || white > kMuchWhite)
    return {step, Verdict::kWarn, what, "too bright: shorter exposure, less gain"};
  return {step, Verdict::kOk, what, ""};
}

Finding ImageCheck::texture(int min_corners, double min_share) const {
  const std::string step = "texture";
  const double few = quantile(corners_, 0.1), share = quantile(matched_, 0.5);
  const std::string what = text(0, quantile(corners_, 0.5), " corners, 90 % of the pairs have more than ", few, "; ",
                                100.0 * share, " % are found in the right image");
  if (quantile(corners_, 0.5) < min_corners)
    return {step, Verdict::kFail, what, "focus, light, or a scene with texture; a lower detector/fast_min_threshold"};
  if (few < min_corners) return {step, Verdict::kWarn, what, "some views have hardly any texture"};
  if (share < min_share)
    return {step, Verdict::kWarn, what,
            "the scene is nearer than stereo/epipolar/max_disparity reaches, or repeats itself"};
  return {step, Verdict::kOk, what, ""};
}

Finding ImageCheck::blur() const {
  constexpr double kMoving = 0.01;    // of the width a pair
  constexpr std::size_t kEnough = 8;  // pairs of either kind
  constexpr double kBlurred = 0.6;    // chosen: healthy rigs keep 0.74 and more
  const std::string step = "motion blur";
  std::vector<double> still, moving;
  const double slow = quantile(moved_, 0.25), fast = std::max(quantile(moved_, 0.75), kMoving);
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    if (moved_[i] <= slow) still.push_back(sharpness_[i]);
    if (moved_[i] >= fast) moving.push_back(sharpness_[i]);
  }
  if (still.size() < kEnough || moving.size() < kEnough)
    return {step, Verdict::kOpen, "the camera did not move enough", "turn with it, and hold it still"};
  const double ratio = quantile(moving, 0.5) / std::max(quantile(still, 0.5), 1e-6);
  const std::string what = text(0, "fast views have ", 100.0 * ratio, " % of the sharpness of slow ones");
  if (ratio < kBlurred) return {step, Verdict::kWarn, what, "shorter exposure (10 ms or less), more light or gain"};
  return {step, Verdict::kOk, what, ""};
}

Finding ImageCheck::frameRate(const std::vector<double>& rotations) const {
  // docs/robot.md: less than 20 deg of turn and half a view between pairs. Half of that leaves room.
  constexpr double kTurn = 20.0, kView = 0.5;  // deg, share of the width
  const std::string step = "frame rate";
  if (moved_.empty() && lost_views_ == 0) return {step, Verdict::kOpen, "no two pairs", ""};
  const double turn = quantile(rotations, 0.95), view = quantile(moved_, 0.95);
  const double unrelated = static_cast<double>(lost_views_) / static_cast<double>(moved_.size() + lost_views_);
  const std::string what = text(1, "up to ", turn, " deg and ", 100.0 * view, " % of the view from pair to pair");
  const std::string remedy = "a higher frame rate, or slower turns";
  if (turn > kTurn || view > kView || unrelated > 0.5) return {step, Verdict::kFail, what, remedy};
  if (turn > 0.5 * kTurn || view > 0.5 * kView) return {step, Verdict::kWarn, what, remedy};
  return {step, Verdict::kOk, what, ""};
}

}  // namespace sdvo
