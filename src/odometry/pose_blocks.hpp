#pragma once

namespace sdvo {

/// What one sighting says of its pose and its point, divided by its noise and its weight's root: columns as in Eigen.
struct WeightedSighting {
  double by_pose[18];  ///< 6x3, the derivatives of each of the residual's three parts
  double by_point[9];  ///< 3x3, a row for each part
  double residual[3];
  int pose;  ///< which of the poses that may move, from zero on; ascending within a point
};

/// A point's products with itself, and with each pose that sees it.
struct PointProducts {
  const double* inverse_hessian;  ///< 3x3
  const double* gradient;         ///< 3
  double* pose_point;             ///< for each sighting 6x3: derivatives by the pose times those by the point
  double* scaled;                 ///< the same times the inverse Hessian
};

/// Adds a point's sightings to the normal equations of the poses and takes away what the point itself can explain of
/// them (Schur complement). Of `hessian`, columns of `stride` numbers, the lower triangle of blocks is filled.
void addEliminatedPoint(const WeightedSighting* sightings, int count, const PointProducts& point, double* hessian,
                        int stride, double* gradient);

}  // namespace sdvo
