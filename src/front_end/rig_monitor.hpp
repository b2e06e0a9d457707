#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/options/feature_extractor_options.hpp"

namespace sdvo {

/// v_right - v_left as a straight line over the columns of the image, px: the effect of a small pitch or roll of the
/// right camera.
struct RowLine {
  double offset = 0.0;  ///< in the middle column
  double slope = 0.0;   ///< px for each column
  int columns = 0;      ///< of the image

  double at(double u) const { return offset + slope * (u - 0.5 * columns); }
  /// Largest |v_right - v_left| in the image, px.
  double most() const { return std::abs(offset) + 0.5 * columns * std::abs(slope); }
};

/// The monitor's diagnosis of a pair.
struct RigDiagnosis {
  std::string words;  ///< the likely cause, or that all is too near; empty otherwise, or if too few corners are found
  std::optional<RowLine> rows;  ///< of a rig whose only fault is that its rows differ
  bool too_near = false;        ///< a part of the scene is nearer than `max_disparity` reaches
  bool refused = false;         ///< left and right do not belong together
};

/// Finds out what is wrong with a rig when few corners are found on their own row at positive disparity. It searches
/// for them in all directions of the right image, blind to gain and brightness. A cause that explains twice as many of
/// them as the next one is named. Takes some milliseconds. Stateless.
class RigMonitor {
 public:
  static constexpr double kReach = 24.0;  ///< px, rows above and below its own in which a corner is looked for

  /// `max_dv`: largest tolerated |v_right - v_left|, px.
  RigMonitor(const RigMonitorOptions& options, double max_dv, double max_disparity);

  /// Whether so few of the corners were found in the right image that diagnose() is worth its time.
  bool isSuspicious(int corners, int found) const;

  /// Images are CV_8U of one size. Views that are both dark, covered or out of focus give no diagnosis. Brightness and
  /// sharpness in the reports of this pair and of the previous one show a side that repeats its image.
  RigDiagnosis diagnose(const cv::Mat& left, const cv::Mat& right, const std::vector<cv::Point2f>& corners,
                        const ExtractionReport& report = {}, const ExtractionReport& before = {}) const;

 private:
  RigMonitorOptions options_;
  double max_dv_, max_disparity_;
};

}  // namespace sdvo
