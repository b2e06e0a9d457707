#include "image_check.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "../common/statistics.hpp"
#include "../common/text.hpp"

namespace sdvo {
namespace {

constexpr const char* kTooBright = "too bright: shorter exposure, less gain";

/// Small bright spots: brighter than all around them, and by kContrast grey levels than the mean there.
cv::Mat findDots(const cv::Mat& image) {
  constexpr double kContrast = 8.0;  // chosen: five times the noise of a camera, 1.5
  cv::Mat highest, mean, dots;
  cv::dilate(image, highest, cv::Mat::ones(3, 3, CV_8U));
  cv::blur(image, mean, cv::Size(7, 7));
  cv::bitwise_and(image == highest, image > mean + kContrast, dots);
  return dots / 255;
}

/// Ratio of the dots in `part` of `before` that are seen again within a pixel of their position plus `offset` px.
double shareFound(const cv::Mat& before, const cv::Mat& around, const cv::Rect& part, cv::Point offset) {
  const cv::Rect moved = (part + offset) & cv::Rect(0, 0, before.cols, before.rows);
  const cv::Mat from = before(moved - offset);
  cv::Mat both;
  cv::bitwise_and(from, around(moved), both);
  return cv::sum(both)[0] / std::max(cv::sum(from)[0], 1.0);
}

/// Ratio of the dots in `part` of `before` that stayed, less the ratio expected by chance.
double shareStayed(const cv::Mat& before, const cv::Mat& around, const cv::Rect& part) {
  constexpr double kDots = 30.0;  // the least for a ratio (chosen)
  if (cv::sum(before(part))[0] < kDots) return 0.0;
  double chance = 0.0;
  for (const cv::Point& offset : {cv::Point(5, 7), cv::Point(-7, 5), cv::Point(7, -5), cv::Point(-5, -7)})
    chance += 0.25 * shareFound(before, around, part, offset);
  return (shareFound(before, around, part, cv::Point()) - chance) / std::max(1.0 - chance, 0.1);
}

}  // namespace

CoarseView::CoarseView(const cv::Mat& image) {
  constexpr double kColumns = 106.0;  // half of the smallest common width, 212
  cv::Mat small;
  const int factor = std::max(1, cvRound(image.cols / kColumns));  // an integer takes a third of the time
  const cv::Size size(image.cols / factor, image.rows / factor);
  cv::resize(image({0, 0, size.width * factor, size.height * factor}), small, size, 0.0, 0.0, cv::INTER_AREA);
  small.convertTo(view_, CV_64F);
}

std::optional<cv::Point2d> CoarseView::motionSince(const CoarseView& before, const cv::Rect& part) const {
  // Ratio of the spectrum's energy at the peak, below which views count as unrelated. Chosen between unrelated views of
  // noise (95 % below 0.27, blurred by up to 5 px) and successive images of KITTI, Karlsruhe and EuRoC (from 0.37).
  constexpr double kRelated = 0.28;
  cv::Mat window;
  cv::createHanningWindow(window, part.size(), CV_64F);
  double response = 0.0;
  const cv::Point2d motion = cv::phaseCorrelate(before.view_(part), view_(part), window, &response);
  if (!(response > kRelated)) return std::nullopt;
  return motion * (1.0 / view_.cols);
}

void RepeatCheck::add(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp) {
  constexpr int kFew = 3;                        // in a row (chosen): a driver may hand out an image twice
  constexpr std::int64_t kLong = 1'000'000'000;  // ns (chosen): no real camera repeats images for so long
  for (std::size_t side = 0; side < 2; ++side) {
    const cv::Mat& image = side == 0 ? left : right;
    const bool repeats =
        image.size() == sides_[side].image.size() &&
        std::equal(image.begin<std::uint8_t>(), image.end<std::uint8_t>(), sides_[side].image.begin<std::uint8_t>());
    sides_[side].repeats = repeats ? sides_[side].repeats + 1 : 0;
    if (repeats) continue;
    sides_[side].image = image.clone();
    sides_[side].since = stamp;
  }
  ++pairs_;
  together_ += sides_[0].repeats > 0 && sides_[1].repeats > 0;
  problem_.clear();
  for (std::size_t side = 0; side < 2; ++side) {
    const bool is_alone = sides_[side].repeats > 0 && sides_[1 - side].repeats == 0;
    sides_[side].alone += is_alone;
    if (is_alone && sides_[side].repeats >= kFew)
      problem_ = std::string("the ") + (side == 0 ? "left" : "right") +
                 " images repeat bit by bit while the other side changes: is that camera or its driver frozen?";
  }
  if (stamp - std::max(sides_[0].since, sides_[1].since) > kLong)
    problem_ = "the images repeat bit by bit: is the driver frozen? A simulated one needs noise";
}

Finding RepeatCheck::judge() const {
  constexpr double kFew = 0.05;  // ratio of the pairs (chosen)
  const bool is_right = sides_[1].alone > sides_[0].alone;
  const int alone = sides_[is_right ? 1 : 0].alone;
  if (alone <= kFew * pairs_)
    return warnIf(together_ > kFew * pairs_,
                  text(0, "in ", together_, " of ", pairs_, " pairs both images repeat bit by bit"),
                  "the driver is frozen or sends images twice; a simulated camera that stands needs noise");
  return {Verdict::kFail,
          text(0, "in ", alone, " of ", pairs_, " pairs the ", is_right ? "right" : "left",
               " image repeats bit by bit, the other one changes"),
          "that camera or its driver is frozen, or runs at a lower rate"};
}

Finding checkExposure(double dark, double bright, bool takes_turns, double min_intensity, double max_intensity) {
  const std::string what = text(0, "mean grey level ", dark, " to ", bright);
  if (takes_turns) return {Verdict::kWarn, what, "exposures take turns from pair to pair, as in HDR: use one exposure"};
  if (dark < min_intensity)
    return {bright < min_intensity ? Verdict::kFail : Verdict::kWarn, what,
            "too dark: light, longer exposure or more gain"};
  return warnIf(bright > max_intensity, what, kTooBright);
}

Finding checkCorners(double corners, int least, const std::string& more) {
  return failIf(corners < least, text(0, corners, " corners") + more,
                "focus, light, or a scene with texture; a lower detector/min_contrast");
}

Finding RefusalCheck::judge(double few) const {
  return judged(refused_ > few * pairs_, refused_ > 0,
                text(0, refused_, " of ", pairs_, " pairs refused") + (why_.empty() ? "" : ": " + why_),
                "look at both images: exchange their topics where the sides are swapped (offline --images, and --infos where "
                "camera_info is right), else mend mounting or calibration");
}

void ImageCheck::add(const cv::Mat& left, const cv::Mat& right, const ExtractionReport& report) {
  constexpr double kWhite = 250.0;  // grey levels
  dark_.push_back(std::min(report.mean_intensity[0], report.mean_intensity[1]));
  bright_.push_back(std::max(report.mean_intensity[0], report.mean_intensity[1]));
  turns_.add(report.mean_intensity[0]);
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
  const double white = quantile(saturated_, 0.9);
  Finding finding =
      checkExposure(quantile(dark_, 0.1), quantile(bright_, 0.9), turns_.takeTurns(), min_intensity, max_intensity);
  if (white > kMuchWhite && !finding.isFault()) finding = {Verdict::kWarn, finding.what, kTooBright};
  finding.what += text(0, ", ", 100.0 * white, " % white");
  return finding;
}

Finding ImageCheck::texture(int min_corners, double min_share) const {
  const double few = quantile(corners_, 0.1), share = quantile(matched_, 0.5);
  Finding usual = checkCorners(quantile(corners_, 0.5), min_corners,
                               text(0, " (median), 90 % of the pairs have ", few, " or more; ", 100.0 * share,
                                    " % are found in the right image"));
  if (usual.isFault()) return usual;
  if (few < min_corners) return {Verdict::kWarn, usual.what, "some views have hardly any texture"};
  return warnIf(share < min_share, usual.what,
                "the scene is nearer than stereo/epipolar/max_disparity reaches, or repeats itself");
}

Finding ImageCheck::blur() const {
  constexpr double kMoving = 0.01;    // of the width a pair
  constexpr std::size_t kEnough = 8;  // pairs of either kind
  constexpr double kBlurred = 0.6;    // chosen: healthy rigs keep 0.74 and more
  std::vector<double> still, moving;
  const double slow = quantile(moved_, 0.25), fast = std::max(quantile(moved_, 0.75), kMoving);
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    if (moved_[i] <= slow) still.push_back(sharpness_[i]);
    if (moved_[i] >= fast) moving.push_back(sharpness_[i]);
  }
  if (still.size() < kEnough || moving.size() < kEnough)
    return {Verdict::kOpen, "the camera did not move enough", "turn with it, and hold it still"};
  const double ratio = quantile(moving, 0.5) / std::max(quantile(still, 0.5), 1e-6);
  const std::string what = text(0, "fast views have ", 100.0 * ratio, " % of the sharpness of slow ones");
  return warnIf(ratio < kBlurred, what, "shorter exposure (10 ms or less), more light or gain");
}

Finding ImageCheck::frameRate(const std::vector<double>& rotations) const {
  // docs/robot.md: less than 20 deg of turn and half a view between pairs. Half of that leaves room.
  constexpr double kTurn = 20.0, kView = 0.5, kUnrelated = 0.5;  // deg, ratios of the width and of the views
  if (moved_.empty() && lost_views_ == 0) return {Verdict::kOpen, "no two pairs"};
  const double turn = quantile(rotations, 0.95), view = quantile(moved_, 0.95);
  const double unrelated = static_cast<double>(lost_views_) / static_cast<double>(moved_.size() + lost_views_);
  const std::string what =
      text(1, "up to ", turn, " deg (limit ", kTurn, ") and ", 100.0 * view, " % of the view (limit ", 100.0 * kView,
           ") from pair to pair, ", 100.0 * unrelated, " % of the views have nothing in common with the one before");
  return judged(turn > kTurn || view > kView, turn > 0.5 * kTurn || view > 0.5 * kView || unrelated > kUnrelated, what,
                "a higher frame rate, or slower turns");
}

/// In parts of the image, because near and far points move differently. Dots are searched only in parts that moved, and
/// only if several did: people who pass move one.
void EmitterCheck::add(const cv::Mat& image) {
  constexpr int kOldest = 20;  // pairs after which the light may be another
  constexpr int kColumns = 3, kRows = 2;
  constexpr std::size_t kFewest = 2;  // parts
  constexpr double kMoved = 0.012;    // of the width; 5 px of 424, more than a dot's neighbourhood
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
  if (moved.size() >= kFewest) {
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
  if (stayed_.size() < kEnough) return {Verdict::kOpen, "the camera did not move enough", "turn and walk with it"};
  const double stayed = quantile(stayed_, 0.5);
  const std::string what = text(0, 100.0 * std::max(stayed, 0.0), " % of the bright dots move with the camera");
  return failIf(stayed > kPattern, what,
                "switch the pattern projector off (RealSense: emitter_enabled 0): its dots say that nothing moves. "
                "Mask text that is printed into the images");
}

}  // namespace sdvo
