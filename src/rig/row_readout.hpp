#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "../belief/motion_hypotheses.hpp"
#include "row_delay.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Readout time of a rolling shutter, from the first row to the last. While the camera turns, each row has another
/// pose: a point is shifted by its image velocity * readout * its row's part of the height. Each pair's pose is fitted
/// and eliminated, so only changes of the rate and of rows show it. Rates at the stamps follow from the mean rates of
/// the motions around them. A tremor that is faster than pairs makes them err: slow rates are the instrument (Wright
/// 1928).
class RowReadout {
 public:
  /// s; a readout of 3 ms causes position errors of 5 sigma.
  static constexpr double kWarn = 0.003;

  struct Estimate {
    double value, sigma;  ///< s

    bool isRolling() const { return std::abs(value) > kWarn && value * value > RowDelay::kSquare * sigma * sigma; }
  };

  /// Adds a pair with rows as they were taken, and its motion of `dt` s since the pair before, the map's newest one.
  void add(const StereoFeatures& features, const MotionHypothesis& found, double dt);
  /// The next pair does not continue the last one.
  void interrupt() { pairs_.clear(), last_.clear(); }

  std::optional<Estimate> estimate() const;
  /// The estimate, s, of a shutter that is certainly rolling, once it is precise enough to be of use; else 0.
  double proved() const;

 private:
  /// A feature and what it was in the pair before.
  struct Seen {
    Eigen::Vector3d before;  ///< u_left, v_left, disparity, px
    Eigen::Vector2d now;     ///< u_left, v_left, px
  };
  struct Pair {
    StereoCamera camera;
    std::vector<Seen> seen;
    Eigen::Isometry3d T_current_previous;
    double dt;             ///< since the pair before, s
    Eigen::Vector3d rate;  ///< mean over that time, rad/s about the camera's axes
  };
  std::vector<Seen> seenBefore(const StereoFeatures& features, const MotionHypothesis& found) const;
  void measure();

  std::deque<Pair> pairs_;                    ///< the last ones; each continues the one before
  std::vector<cv::Point2f> last_;             ///< features of the last pair, px
  double information_ = 0.0, product_ = 0.0;  ///< of instrument and shift for 1 s, of instrument and residual
  /// Sums over pairs of squares and products of information and product, for the empirical deviation.
  double information_square_ = 0.0, mixed_ = 0.0, product_square_ = 0.0;
};

}  // namespace sdvo
