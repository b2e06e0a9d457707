#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "../belief/motion_hypotheses.hpp"
#include "row_delay.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Readout time of a rolling shutter, from the first row to the last. While the camera turns, each row has another
/// pose: a point is shifted by its image velocity * readout * rowTime(). Under a constant rate, a point that keeps its
/// row has the same shift in both pairs of a motion. So only changes of the rate and of rows constrain the readout.
/// Each pair's pose is estimated with it and eliminated. Rates at the stamps follow from the mean rates of the motions
/// around them. A tremor faster than pairs makes them err, and errors of a regressor bias the readout, so slow rates
/// are the instrument (Wright 1928).
class RowReadout {
 public:
  /// s; a readout of 3 ms causes position errors of 5 standard deviations of the published covariance.
  static constexpr double kWarn = 0.003;

  struct Estimate {
    double value, sigma;  ///< s

    bool isRolling() const { return std::abs(value) > kWarn && value * value > RowDelay::kSquare * sigma * sigma; }
  };

  /// Adds a pair before its rows are moved to the stamp. `found`: its motion since the previous pair, `dt` s before,
  /// which is the map's newest one.
  void add(const StereoFeatures& features, const MotionHypothesis& found, double dt);
  /// The next pair does not continue the last one.
  void interrupt() { pairs_.clear(), last_positions_.clear(); }

  /// None from fewer than two pairs, or while its standard deviation is RowDelay::kFail or larger.
  std::optional<Estimate> estimate() const;

  /// Covariance of a pair's motion by the unknown readout alone: its second moment around `compensated`, s, carried to
  /// the motion. Call it before add() of the same pair.
  Matrix6d momentOf(const StereoFeatures& features, const MotionHypothesis& found, double dt, double compensated) const;
  /// The estimate, s, from when the shutter was certainly rolling and the standard deviation below kWarn; else 0.
  double usableValue() const { return is_compensated_ ? product_ / information_ : 0.0; }

 private:
  /// A point in two successive pairs.
  struct Track {
    Eigen::Vector3d before;  ///< u_left, v_left, disparity, px
    Eigen::Vector2d now;     ///< u_left, v_left, px
  };
  struct Pair {
    StereoCamera camera;
    std::vector<Track> tracks;
    Eigen::Isometry3d T_current_previous;
    double dt;             ///< since the pair before, s
    Eigen::Vector3d rate;  ///< mean since the pair before, rad/s about the camera's axes
  };
  std::vector<Track> tracksOf(const StereoFeatures& features, const MotionHypothesis& found, std::size_t most) const;
  void measure();
  double squareAround(double compensated) const;

  std::deque<Pair> pairs_;                   ///< the last ones; each continues the one before
  std::vector<cv::Point2f> last_positions_;  ///< of all features of the last pair, px
  /// Sums over pairs of instrument * shift for a readout of 1 s, and of instrument * residual. Their ratio is the
  /// readout, s.
  double information_ = 0.0, product_ = 0.0;
  /// Sums of a pair's information^2, information * product, and product^2, for the standard deviation.
  double information_square_ = 0.0, mixed_ = 0.0, product_square_ = 0.0;
  bool is_compensated_ = false;
};

}  // namespace sdvo
