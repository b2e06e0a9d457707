#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "finding.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// An image reduced to about a hundred columns, in which small bright dots average out.
class CoarseView {
 public:
  CoarseView() = default;
  /// `image` is CV_8UC1.
  explicit CoarseView(const cv::Mat& image);

  bool empty() const { return view_.empty(); }
  cv::Size size() const { return view_.size(); }

  /// Dominant shift of `part` (a rectangle of the coarse view) since `before`, as a ratio of the image's width. Nothing
  /// if the views are unrelated.
  std::optional<cv::Point2d> motionSince(const CoarseView& before, const cv::Rect& part) const;
  std::optional<cv::Point2d> motionSince(const CoarseView& before) const {
    return motionSince(before, cv::Rect(cv::Point(), size()));
  }

 private:
  cv::Mat view_;  ///< CV_64F, grey levels
};

/// Whether images repeat bit by bit, which noise rules out for a real camera: on both sides, or on one while the other
/// changes.
class RepeatCheck {
 public:
  /// The next pair, CV_8UC1; `stamp` in ns.
  void add(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp);

  /// Fault of the last pairs in words; empty: they do not repeat.
  const std::string& problem() const { return problem_; }
  /// Of all pairs.
  Finding judge() const;

 private:
  struct Side {
    cv::Mat image;
    std::int64_t since = 0;  ///< ns
    int repeats = 0;         ///< in a row
    int alone = 0;           ///< pairs in which it repeated and the other one did not
  };
  std::array<Side, 2> sides_;
  int pairs_ = 0;
  int together_ = 0;  ///< pairs in which both repeated
  std::string problem_;
};

/// Whether a camera's exposures take turns from pair to pair.
class ExposureTurns {
 public:
  /// Mean grey level of the next pair.
  void add(double mean) {
    const bool is_brighter = mean > kMuch * last_, is_darker = last_ > kMuch * mean;
    // After an even number the next one should be brighter, after an odd one darker; else it begins anew.
    turns_ = (turns_ % 2 == 0 ? is_brighter : is_darker) ? turns_ + 1 : is_brighter;
    last_ = mean;
  }

  bool takeTurns() const { return turns_ >= kTurns; }

 private:
  static constexpr double kMuch = 8.0;  // ratio (chosen): up to 1 : 7 descriptors and patches bridge it
  static constexpr int kTurns = 6;      // in a row (chosen): more than a lamp that flickers

  double last_ = 0.0;
  int turns_ = 0;  ///< brighter and darker ones alternately, in a row
};

/// `dark`, `bright`: mean grey levels of the darker and the brighter side.
Finding checkExposure(double dark, double bright, bool takes_turns, double min_intensity, double max_intensity);

/// `more`: other figures.
Finding checkCorners(double corners, int least, const std::string& more = "");

/// Whether left and right belong together, as the extraction judges each pair.
class RefusalCheck {
 public:
  void add(const ExtractionReport& report) {
    ++pairs_;
    if (!report.refused) return;
    ++refused_;
    why_ = report.status;
  }

  int pairs() const { return pairs_; }
  int refused() const { return refused_; }
  /// `few`: ratio of refused pairs up to which it is no failure.
  Finding judge(double few) const;

 private:
  int pairs_ = 0, refused_ = 0;
  std::string why_;
};

/// Quality of the images for features: exposure, texture, motion blur, and motion of the view from pair to pair.
class ImageCheck {
 public:
  /// A pair (CV_8UC1) with what extraction reports of it.
  void add(const cv::Mat& left, const cv::Mat& right, const ExtractionReport& report);

  /// checkExposure(), and the ratio of white pixels.
  Finding exposure(double min_intensity, double max_intensity) const;
  /// `min_share`: ratio of the corners that must be found in the right image.
  Finding texture(int min_corners, double min_share) const;
  Finding blur() const;
  /// `rotations`: deg, of each pair whose motion is known.
  Finding frameRate(const std::vector<double>& rotations) const;

 private:
  CoarseView view_;
  ExposureTurns turns_;
  std::vector<double> dark_, bright_, saturated_;  ///< of each pair: mean grey levels, share of white pixels
  std::vector<double> corners_, matched_;          ///< of each pair: number of corners, share found in the right image
  std::vector<double> sharpness_, moved_;  ///< of each pair with a common motion: grey levels a px; share of the width
  int lost_views_ = 0;                     ///< pairs without a common motion since the pair before
};

/// Finds the dots of a pattern projector: they stay where they are in the image while the scene moves.
class EmitterCheck {
 public:
  /// The left image of the next pair, CV_8UC1. Cheap while nothing moves.
  void add(const cv::Mat& image);

  Finding judge() const;

 private:
  CoarseView view_;             ///< where the scene was last compared
  cv::Mat dots_;                ///< CV_8U, 1 where a dot is
  int age_ = 0;                 ///< pairs since then
  std::vector<double> stayed_;  ///< of each comparison, share of the dots that stayed beyond chance
};

}  // namespace sdvo
