#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "../motion/noise.hpp"

namespace sdvo {

/// Row of an inlier of the pair's motion.
struct RowMotion {
  double velocity;  ///< down in the left image, px/s
  double dv;        ///< v_right - v_left, px, less the known delay's effect and the RowPattern, unless isOfOtherPairs()
  int part;         ///< of the image (RowDelay::partOf)
};

/// Delay of a rig's right images, from rows. In a late image, a point that moves down at v' px/s is v' * delay px
/// lower. Other errors of rows are fitted, too: constant ones of rectification in each part of the image, and one of a
/// lower right camera, proportional to disparity. Instrumental variables (Wright 1928), with a fixed effect for each
/// part.
class RowDelay {
 public:
  static constexpr int kColumns = 6, kRows = 4, kParts = kColumns * kRows;  ///< of the image
  static constexpr double kMemory = 0.995;  ///< factor on the weight of previous pairs: some 200 pairs (chosen)
  static constexpr double kKernel = 0.5;    ///< px (chosen): of Huber's kernel; errors of healthy rows are smaller
  static constexpr double kSquare = noiseGate(1);  ///< squared standard deviations that chance explains
  /// Delays to warn of, and to fail at, s. 2 ms is 2 cm at 10 m/s, and 0.4 px at 100 deg/s and f = 120 px. Synchronous
  /// rigs have 0.2 ms at most (significantValue(), twelve drives). 10 ms is 3.7 px at 100 deg/s and f = 212 px: beyond
  /// 3 m, disparities of a baseline of 5 cm are then negative.
  static constexpr double kWarn = 0.002, kFail = 0.01;

  /// Rows of a feature.
  struct Sample {
    int part;         ///< of the image, row by row
    double dv;        ///< v_right - v_left, px
    double velocity;  ///< of its row, px/s
    /// px/s: instrument, the row's velocity by slow rotations; where these are unknown, its whole velocity.
    double turning;
    double disparity;  ///< px
  };
  static int partOf(double u, double v, int width, int height) {
    return gridCell(u, v, width, height, kColumns, kRows);
  }

  struct Estimate {
    double value, sigma;  ///< s

    /// Its significant part, s: the root of value^2 - kSquare * sigma^2 with the sign of `value`, or 0.
    double significantValue() const;
  };

  /// `memory`: factor on the weight of previous pairs with each new pair. A pair is left out if its instrument is below
  /// `least_turning` (px/s, RMS), because errors of the velocity would bias the delay. `block`: number of successive
  /// pairs with correlated errors, because they may see the same points.
  RowDelay(double memory, double least_turning, int block = 1)
      : memory_(memory), least_turning_(least_turning), pairs_of_block_(block) {}

  void add(const std::vector<Sample>& pair);

  /// None while its standard deviation is kFail or larger.
  std::optional<Estimate> estimate() const;

 private:
  struct Sums {
    double weight = 0.0;
    Eigen::Vector3d motion = Eigen::Vector3d::Zero();  ///< weighted sums of turning, velocity (px/s) and disparity (px)
    double dv = 0.0;                                   ///< px
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    Eigen::Vector3d product = Eigen::Vector3d::Zero();  ///< of motion and dv

    void add(double weight, const Eigen::Vector3d& motion, double dv);
    Eigen::Vector3d meanMotion() const { return motion / weight; }
    double meanDv() const { return dv / weight; }
    /// Of dv after the regression on motion by `value`, px.
    double residual(const Eigen::Vector2d& value, const Eigen::Vector3d& motion, double dv) const;
  };
  using Parts = std::array<Sums, kParts>;

  /// Regression of dv on velocity and disparity, all less the means of their part. The factor of the velocity is the
  /// delay, s. The instrument of the velocity is its part by rotations. In a translation, velocity and rectification
  /// errors both depend on depth, and their correlation would bias the delay.
  struct Fit {
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::Vector2d value = Eigen::Vector2d::Zero();
  };
  static Fit fit(const Parts& parts);

  double memory_, least_turning_;
  int pairs_of_block_;
  Parts parts_;
  Eigen::Matrix2d gradient_squares_ = Eigen::Matrix2d::Zero();  ///< sum over blocks
  Eigen::Vector2d block_ = Eigen::Vector2d::Zero();             ///< gradient of the block that has begun
  int pairs_ = 0;
  double blocks_ = 0.0;
};

}  // namespace sdvo
