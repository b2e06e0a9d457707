#pragma once

#include <cstddef>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_matcher.hpp"

namespace sdvo {

/// Distance along the row after which the texture of a match (by its index) repeats, px; 0: it does not.
using PeriodOf = std::function<float(std::size_t match)>;

/// A match (by its index) whose block another one in the right image may resemble as much.
struct Rival {
  std::size_t match;
  float distance;  ///< px along the row
};

/// Gives matches their periods where the texture in view repeats, unless unique ones around agree.
void markRepeated(const std::vector<cv::Point2f>& left_positions, const std::vector<Rival>& rivals,
                  const PeriodOf& periodOf, std::vector<StereoMatch>& matches);

/// Removes matches whose disparity may be a period off, and says so where they are most of them.
std::string removeRepeated(std::vector<StereoMatch>& matches, const StereoCamera& camera, double max_disparity);

}  // namespace sdvo
