#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

struct RigMonitorOptions {
  bool enabled = true;
  double suspicious_share = 0.4;
  int corners = 120;
  double reach = 24.0;

  void describe(OptionList& list) {
    list.add("enabled", enabled, "refuse pairs whose rows do not agree, and say what is wrong with the rig");
    list.add("suspicious_share", suspicious_share, {0.0, 1.0}, "",
             "the rig is looked at when a smaller share of the corners is found in the right image");
    list.add("corners", corners, {50, 10000}, "", "corners that are looked for then, in all directions");
    list.add("reach", reach, {4.0, 200.0}, "px", "rows above and below its own in which each is looked for");
  }
};

/// Finds out what is wrong with a rig when few corners are found on their own row at positive disparity. It searches
/// for them in all directions of the right image, blind to gain and brightness, and takes some milliseconds. Stateless.
class RigMonitor {
 public:
  /// `max_dv` in px: rows may differ by that. Throws std::invalid_argument when an option is out of its range.
  RigMonitor(const RigMonitorOptions& options, double max_dv, double max_disparity);

  /// Whether so few of the corners were found that the rig is worth a look.
  bool isSuspicious(int corners, int found) const;

  /// The likely cause in words; empty when the rig is in order, or when too little is found to say (dark, covered or
  /// out of focus). Images are CV_8U of one size. Corners that come first are looked at first.
  std::string diagnose(const cv::Mat& left, const cv::Mat& right, const std::vector<cv::Point2f>& corners) const;

 private:
  RigMonitorOptions options_;
  double max_dv_, max_disparity_;
};

}  // namespace sdvo
