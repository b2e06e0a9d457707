#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

struct RigMonitorOptions {
  double suspicious_share = 0.4;

  void describe(OptionList& list) {
    list.add(
        "suspicious_share", suspicious_share, {0.0, 1.0}, "",
        "the rig is looked at, and the pair refused where its rows do not agree, when a smaller share of the corners "
        "is found in the right image; 0: never");
  }
};

/// How much lower the right image shows what the left one does: a straight line over its columns, px. A right camera
/// that is pitched or rolled by a small angle shows that.
struct RowLine {
  double offset = 0.0;  ///< in the middle column
  double slope = 0.0;   ///< px for each column
  int columns = 0;      ///< of the image

  double at(double u) const { return offset + slope * (u - 0.5 * columns); }
  /// Its largest amount in the image.
  double most() const { return std::abs(offset) + 0.5 * columns * std::abs(slope); }
};

/// The monitor's diagnosis of a pair.
struct RigDiagnosis {
  std::string words;  ///< the likely cause; empty when the rig is in order, or when too little is found to say
  std::optional<RowLine> rows;  ///< by which they differ, where that is all that is wrong
  bool too_near = false;        ///< a part of the scene is nearer than `max_disparity` reaches
  bool refused = false;         ///< left and right do not belong together
};

/// Finds out what is wrong with a rig when few corners are found on their own row at positive disparity. It searches
/// for them in all directions of the right image, blind to gain and brightness. A cause that explains twice as many of
/// them as the next one is named. Takes some milliseconds. Stateless.
class RigMonitor {
 public:
  static constexpr double kReach = 24.0;  ///< px, rows above and below its own in which a corner is looked for

  /// `max_dv` in px: rows may differ by that. Throws std::invalid_argument when an option is out of its range.
  RigMonitor(const RigMonitorOptions& options, double max_dv, double max_disparity);

  /// Whether so few of the corners were found that the rig is worth a look.
  bool isSuspicious(int corners, int found) const;

  /// Too little to say is found where both views are dark, covered or out of focus. Images are CV_8U of one size.
  /// Corners that come first are looked at first. Brightness and sharpness in the reports of this pair and of the one
  /// before it show a side that repeats its image.
  RigDiagnosis diagnose(const cv::Mat& left, const cv::Mat& right, const std::vector<cv::Point2f>& corners,
                        const ExtractionReport& report = {}, const ExtractionReport& before = {}) const;

 private:
  RigMonitorOptions options_;
  double max_dv_, max_disparity_;
};

}  // namespace sdvo
