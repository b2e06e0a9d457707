#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {

/// How much later the right image of a rig is taken, from rows. A point that moves down in the right image at v' px/s
/// is seen v' * delay px lower by a camera that is late. Errors of the rectification stay in their part of the image. A
/// right camera that sits lower shifts rows by a ratio of the disparity. Neither counts as a delay. The estimator is
/// that of instrumental variables (Wright 1928) with a fixed effect for each part of the image.
class RowDelay {
 public:
  static constexpr int kColumns = 6, kRows = 4, kParts = kColumns * kRows;  ///< of the image
  static constexpr double kMemory = 0.995;         ///< ratio of the past that a pair leaves: some 200 pairs (chosen)
  static constexpr double kKernel = 0.5;           ///< px (chosen): errors of healthy rows are smaller
  static constexpr double kSquare = noiseGate(1);  ///< of the standard deviations beyond which a delay is proved
  /// s. 2 ms is 2 cm at 10 m/s, and 0.4 px at 100 deg/s and f = 120 px. Of rigs in step (twelve drives) at most 0.2 ms
  /// are proved. 10 ms is 3.7 px at 100 deg/s and f = 212 px: beyond 3 m a rig of 5 cm then has negative disparities.
  static constexpr double kWarn = 0.002, kFail = 0.01;

  /// A point that both views show.
  struct Sample {
    int cell;          ///< part of the image, row by row
    double dv;         ///< v_right - v_left, px
    double velocity;   ///< of its row in the right image, px/s
    double turning;    ///< instrument: the part of that which the camera's slow rotation gives; else the same, px/s
    double disparity;  ///< px
  };
  static int cellOf(double u, double v, int width, int height);

  struct Estimate {
    double value, sigma;  ///< s

    /// By how much it differs from 0, s, as far as chance does not explain that.
    double proved() const;
  };

  /// `memory`: ratio of the past that a pair leaves. Pairs are left out where the instrument is below `least_turning`
  /// (px/s, RMS): errors of the velocity must be smaller.
  /// `block`: number of successive pairs with correlated errors, because they may see the same points.
  RowDelay(double memory, double least_turning, int block = 1)
      : memory_(memory), least_turning_(least_turning), pairs_of_block_(block) {}

  void add(const std::vector<Sample>& pair);

  /// None while its standard deviation is larger than a delay may be, kFail.
  std::optional<Estimate> estimate() const;

 private:
  struct Sums {
    double weight = 0.0;
    Eigen::Vector3d motion = Eigen::Vector3d::Zero();  ///< of turning, velocity (px/s) and disparity (px)
    double dv = 0.0;                                   ///< px
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    Eigen::Vector3d product = Eigen::Vector3d::Zero();  ///< of motion and dv

    void add(double weight, const Eigen::Vector3d& motion, double dv);
    Eigen::Vector3d meanMotion() const { return motion / weight; }
    double meanDv() const { return dv / weight; }
  };
  using Cells = std::array<Sums, kParts>;

  /// Regression of dv on velocity, whose factor is the delay, and disparity, all less the mean of their part. The
  /// instrument of the velocity is the part of it that rotations cause. In a translation the velocity depends on depth,
  /// as do errors of the rectification, and would be correlated with them.
  struct Fit {
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::Vector2d value = Eigen::Vector2d::Zero();
  };
  static Fit fit(const Cells& cells);

  double memory_, least_turning_;
  int pairs_of_block_;
  Cells cells_;
  Eigen::Matrix2d spread_ = Eigen::Matrix2d::Zero();  ///< of the gradients of whole blocks
  Eigen::Vector2d block_ = Eigen::Vector2d::Zero();   ///< gradients of the pairs of the one that has begun
  int pairs_ = 0;
  double blocks_ = 0.0;
};

}  // namespace sdvo
