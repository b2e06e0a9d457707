#include "emitter_check.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "../common/quantile.hpp"
#include "../common/text.hpp"

namespace sdvo {
namespace {

/// Small bright spots: brighter than all around them, and by kContrast grey levels than the mean there.
cv::Mat findDots(const cv::Mat& image) {
  constexpr double kContrast = 8.0;  // chosen: five times the noise of a camera, 1.5
  cv::Mat highest, mean, dots;
  cv::dilate(image, highest, cv::Mat::ones(3, 3, CV_8U));
  cv::blur(image, mean, cv::Size(7, 7));
  cv::bitwise_and(image == highest, image > mean + kContrast, dots);
  return dots / 255;
}

/// Share of the dots in `part` of `before` that are seen within a pixel of where they were, moved by `offset` px.
double shareFound(const cv::Mat& before, const cv::Mat& around, const cv::Rect& part, cv::Point offset) {
  const cv::Rect moved = (part + offset) & cv::Rect(0, 0, before.cols, before.rows);
  const cv::Mat from = before(moved - offset);
  cv::Mat both;
  cv::bitwise_and(from, around(moved), both);
  return cv::sum(both)[0] / std::max(cv::sum(from)[0], 1.0);
}

/// Share of the dots in `part` of `before` that stayed beyond chance.
double shareStayed(const cv::Mat& before, const cv::Mat& around, const cv::Rect& part) {
  constexpr double kDots = 30.0;  // fewer tell nothing
  if (cv::sum(before(part))[0] < kDots) return 0.0;
  double chance = 0.0;
  for (const cv::Point& offset : {cv::Point(5, 7), cv::Point(-7, 5), cv::Point(7, -5), cv::Point(-5, -7)})
    chance += 0.25 * shareFound(before, around, part, offset);
  return (shareFound(before, around, part, cv::Point()) - chance) / std::max(1.0 - chance, 0.1);
}

}  // namespace

/// Part by part, for near and far things move differently. Dots are looked for only where there is motion, and only
/// when most parts move: people who pass move some.
void EmitterCheck::add(const cv::Mat& image) {
  constexpr int kOldest = 20;  // pairs after which the light may be another
  constexpr int kColumns = 3, kRows = 2;
  constexpr std::size_t kMost = 4;  // parts
  constexpr double kMoved = 0.012;  // of the width; 5 px of 424, more than a dot's neighbourhood
  CoarseView view(image);
  const bool is_comparable = !view_.empty() && dots_.size() == image.size();
  const cv::Size coarse(view.size().width / kColumns, view.size().height / kRows);
  const cv::Size fine(image.cols / kColumns, image.rows / kRows);
  cv::Mat dots, around;
  std::vector<cv::Point> moved;
  for (int part = 0; is_comparable && part < kColumns * kRows; ++part) {
    const cv::Point at(part % kColumns, part / kColumns);
    const auto motion = view.motionSince(view_, {cv::Point(at.x * coarse.width, at.y * coarse.height), coarse});
    if (motion && std::hypot(motion->x, motion->y) >= kMoved) moved.push_back(at);
  }
  if (moved.size() >= kMost) {
    dots = findDots(image);
    cv::dilate(dots, around, cv::Mat::ones(3, 3, CV_8U));
    for (const cv::Point& at : moved)
      stayed_.push_back(shareStayed(dots_, around, {cv::Point(at.x * fine.width, at.y * fine.height), fine}));
  }
  if (is_comparable && dots.empty() && ++age_ <= kOldest) return;
  view_ = std::move(view);
  dots_ = dots.empty() ? findDots(image) : dots;
  age_ = 0;
}

Finding EmitterCheck::judge() const {
  constexpr std::size_t kEnough = 12;  // parts that moved: each of the six twice
  constexpr double kPattern = 0.3;     // ratio; lab/test/check_camera_check: 0.5 with a projector, 0.04 without
  const std::string step = "emitter";
  if (stayed_.size() < kEnough)
    return {step, Verdict::kOpen, "the camera did not move enough", "turn and walk with it"};
  const double stayed = quantile(stayed_, 0.5);
  const std::string what = text(0, 100.0 * std::max(stayed, 0.0), " % of the bright dots move with the camera");
  if (stayed > kPattern)
    return {
        step, Verdict::kFail, what,
        "switch the pattern projector off (RealSense: emitter_enabled 0): its dots say that nothing moves. Mask text "
        "that is printed into the images"};
  return {step, Verdict::kOk, what, ""};
}

}  // namespace sdvo
