#include "stereo_descriptor_vo/map/point_elimination.hpp"

#include <cmath>
#include <cstddef>

#include "../common/kernel.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

// Vectors go from function to function only where these become part of their caller.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace sdvo {
namespace {

/// (x, y, z), and a fourth number that means nothing.
typedef DoubleLanes Three;
constexpr Three kX = {1.0, 0.0, 0.0, 0.0}, kY = {0.0, 1.0, 0.0, 0.0}, kZ = {0.0, 0.0, 1.0, 0.0};

SDVO_IN_KERNEL Three loaded(const double* values) {
  Three v;
  load(values, v);
  return v;
}
SDVO_IN_KERNEL void addTo(double* values, const Three& v) {
  store(loaded(values) + v, values);
}
SDVO_IN_KERNEL double sumOf(const Three& v) {
  return v[0] + v[1] + v[2];
}
/// (y, z, x)
SDVO_IN_KERNEL Three rotated(const Three& v) {
#ifdef __clang__
  return __builtin_shufflevector(v, v, 1, 2, 0, 3);
#else
  typedef long long Order __attribute__((vector_size(32)));
  return __builtin_shuffle(v, Order{1, 2, 0, 3});
#endif
}
SDVO_IN_KERNEL Three cross(const Three& a, const Three& b) {
  return rotated(a * rotated(b) - rotated(a) * b);
}

/// Where an observation puts its point, as predictObservation() has it, and how far that is from the measurement. T:
/// the columns of T_camera_anchor.
struct PredictedObservation {
  Three P;           ///< scaled point in the camera's frame
  double inverse_z;  ///< 1 / P.z
  Three ray;         ///< (P.x / P.z, P.y / P.z, rho / P.z)
  Three inverse_noise;
  double shape;    ///< derivative of the disparity's error by the calibration's bend: RigCalibration::shape()
  Three residual;  ///< normalised
  double square;

  SDVO_IN_KERNEL PredictedObservation(const WindowProjection& projection, const ObservedPoint& observed,
                                      const WindowObservation& seen, const double* T) {
    const double* point = observed.ray_and_inverse_depth.data();
    P = loaded(T) * point[0] + loaded(T + 4) * point[1] + (loaded(T + 8) + loaded(T + 12) * point[2]);
    inverse_z = 1.0 / P[2];
    ray = Three{P[0], P[1], point[2], 0.0} * inverse_z;
    const double* measured = seen.measurement.data();
    const double x = (measured[0] - projection.centre[0]) / projection.focal[0];
    shape = x * x;
    const Three centre = loaded(projection.centre) + kZ * (projection.bend * shape);
    inverse_noise = (kX + kY) * (1.0 / seen.sigma) + kZ * observed.inverse_disparity_sigma;
    const Three measurement = {measured[0], measured[1], measured[2], 0.0};
    residual = inverse_noise * ((measurement - centre) - loaded(projection.focal) * ray);
    square = isInFront() ? sumOf(residual * residual) : kBehindSquare;
  }
  SDVO_IN_KERNEL bool isInFront() const { return P[2] >= kNearestScaled; }
};

struct SquareObservations {
  static SDVO_IN_KERNEL void run(const WindowProjection* projection, const ObservedPoint* point, double* squares) {
    for (int i = 0; i < point->count; ++i) {
      const WindowObservation& seen = point->observations[i];
      const double* T = point->T_camera_anchor[seen.frame].data();
      squares[i] = PredictedObservation(*projection, *point, seen, T).square;
    }
  }
};

/// Derivatives A of an observation by P, divided by its noise: (a, 0, -a x), (0, b, -b y), (0, 0, -d); and of its
/// disparity by rho, P held.
struct Derivatives {
  Three aside, ahead;  ///< (a, b, 0) and (a x, b y, d)
  double by_rho;

  SDVO_IN_KERNEL Derivatives(const WindowProjection& projection, const PredictedObservation& at) {
    const Three scale = at.inverse_noise * loaded(projection.focal) * at.inverse_z;
    aside = scale * (kX + kY);
    ahead = scale * at.ray;
    by_rho = scale[2];
  }
  SDVO_IN_KERNEL Three times(const double* column) const { return aside * loaded(column) - ahead * column[2]; }
  SDVO_IN_KERNEL Three transposedTimes(const Three& v) const { return aside * v - kZ * sumOf(ahead * v); }
};

/// Columns of w A^T A: what an observation says of P.
struct Information {
  Three x, y, z;

  SDVO_IN_KERNEL Information(const Derivatives& A, double w) {
    const Three square = w * A.aside * A.aside, mixed = w * A.aside * A.ahead;
    x = kX * square - kZ * mixed[0];
    y = kY * square - kZ * mixed[1];
    z = kZ * (w * sumOf(A.ahead * A.ahead)) - mixed;
  }
  SDVO_IN_KERNEL Three times(const double* v) const { return x * v[0] + y * v[1] + z * v[2]; }
};

/// How a pose's left perturbation moves P: by [rho I, -[P]x]. Products are with the transposed of it.
struct Lever {
  Three P;
  double rho;

  SDVO_IN_KERNEL void multiply(const Three& v, PoseVector& product) const {
    store(rho * v, product.translation);
    store(cross(P, v), product.rotation);
  }
  SDVO_IN_KERNEL void addProduct(const Three& v, double weight, PoseVector& sum) const {
    addTo(sum.translation, weight * rho * v);
    addTo(sum.rotation, weight * cross(P, v));
  }
};

/// A point's sums over its observations, those of vectors part by part of the residual.
struct PointSums {
  Three H00{}, H10{}, H11{}, H20{}, H21{}, H22{}, g0{}, g1{}, g2{};
  Three by0{}, by1{}, by2{};              ///< derivatives
  Three shaped0{}, shaped1{}, shaped2{};  ///< … times the calibration's shape
  double weight = 0.0, residual = 0.0;
  double shape = 0.0, shape_square = 0.0, shape_residual = 0.0;
  int observations = 0;

  /// J: columns of the derivatives by the point.
  SDVO_IN_KERNEL void add(const PredictedObservation& at, double w, const Three& J0, const Three& J1, const Three& J2) {
    const Three w0 = w * J0, w1 = w * J1, w2 = w * J2, pull = w * at.residual;
    H00 += w0 * J0, H10 += w1 * J0, H11 += w1 * J1, H20 += w2 * J0, H21 += w2 * J1, H22 += w2 * J2;
    g0 += pull * J0, g1 += pull * J1, g2 += pull * J2;
    by0 += w0, by1 += w1, by2 += w2;
    shaped0 += at.shape * w0, shaped1 += at.shape * w1, shaped2 += at.shape * w2;
    const double w_shape = w * at.shape;
    weight += w, residual += pull[2];
    shape += w_shape, shape_square += w_shape * at.shape, shape_residual += pull[2] * at.shape;
    ++observations;
  }
};

/// Lower triangle of L^-1 of a symmetric matrix H = L L^T, column by column.
struct InverseRoot {
  Three column0, column1, column2;

  SDVO_IN_KERNEL InverseRoot(const PointSums& sums, double damping) {
    constexpr double kLeast = 1e-9;  // of what nothing is known of
    const double damped = 1.0 + damping;
    const double R00 = 1.0 / std::sqrt(sumOf(sums.H00) * damped + kLeast);
    const double L10 = sumOf(sums.H10) * R00, L20 = sumOf(sums.H20) * R00;
    const double R11 = 1.0 / std::sqrt(sumOf(sums.H11) * damped + kLeast - L10 * L10);
    const double L21 = (sumOf(sums.H21) - L20 * L10) * R11;
    const double R22 = 1.0 / std::sqrt(sumOf(sums.H22) * damped + kLeast - L20 * L20 - L21 * L21);
    const double R10 = -L10 * R00 * R11;
    column0 = Three{R00, R10, -(L20 * R00 + L21 * R10) * R22, 0.0};
    column1 = Three{0.0, R11, -L21 * R11 * R22, 0.0};
    column2 = Three{0.0, 0.0, R22, 0.0};
  }
  SDVO_IN_KERNEL Three times(double x, double y, double z) const { return column0 * x + column1 * y + column2 * z; }
};

/// A factor's columns in registers.
struct FactorColumns {
  Three translation0, translation1, translation2, rotation0, rotation1, rotation2;

  SDVO_IN_KERNEL explicit FactorColumns(const PoseFactor& factor)
      : translation0(loaded(factor.Y[0].translation)),
        translation1(loaded(factor.Y[1].translation)),
        translation2(loaded(factor.Y[2].translation)),
        rotation0(loaded(factor.Y[0].rotation)),
        rotation1(loaded(factor.Y[1].rotation)),
        rotation2(loaded(factor.Y[2].rotation)) {}
  SDVO_IN_KERNEL void subtractFrom(PoseVector& column, double a, double b, double c) const {
    addTo(column.translation, -(translation0 * a + translation1 * b + translation2 * c));
    addTo(column.rotation, -(rotation0 * a + rotation1 * b + rotation2 * c));
  }
};

std::size_t indexOf(int row, int column) {
  return static_cast<std::size_t>(row * (row + 1) / 2 + column);
}

/// PoseEquations::add().
struct AddPoint {
  static SDVO_IN_KERNEL void run(const WindowProjection* projection, const ObservedPoint* point,
                                 const Linearisation* linearisation, PoseFactor* factors, double* squares,
                                 PoseEquations::Block* blocks, PoseEquations::Border* borders,
                                 EliminatedPoint* eliminated, RigCalibration::Matrix* calibration_hessian,
                                 RigCalibration::Vector* calibration_gradient) {
    PointSums sums;
    int moving = 0;
    for (int i = 0; i < point->count; ++i) {
      const WindowObservation& seen = point->observations[i];
      const double* T = point->T_camera_anchor[seen.frame].data();
      const PredictedObservation at(*projection, *point, seen, T);
      squares[i] = at.square;
      if (!at.isInFront()) continue;
      const double w = linearisation->bend / (linearisation->bend + at.square);
      const Derivatives A(*projection, at);
      sums.add(at, w, A.times(T), A.times(T + 4), A.times(T + 12) + kZ * A.by_rho);
      if (seen.frame == 0) continue;
      PoseFactor& factor = factors[moving++];
      factor.pose = seen.frame - 1;
      addPose({at.P, point->ray_and_inverse_depth.z()}, A, at, w, T, factor, blocks[indexOf(factor.pose, factor.pose)],
              borders[factor.pose]);
    }

    // What the point is in, times R or R^T.
    const InverseRoot R(sums, linearisation->damping);
    const double disparity = point->inverse_disparity_sigma;
    const Three gradient = R.times(sumOf(sums.g0), sumOf(sums.g1), sumOf(sums.g2));
    const Three by_offset = disparity * R.times(sums.by0[2], sums.by1[2], sums.by2[2]);
    const Three by_bend = disparity * R.times(sums.shaped0[2], sums.shaped1[2], sums.shaped2[2]);
    for (int k = 0; k < moving; ++k) multiply(R, factors[k]);
    for (int k = 0; k < moving; ++k) {
      const FactorColumns own(factors[k]);
      PoseVector* border = borders[factors[k].pose].columns;
      own.subtractFrom(border[0], by_offset[0], by_offset[1], by_offset[2]);
      own.subtractFrom(border[1], by_bend[0], by_bend[1], by_bend[2]);
      own.subtractFrom(factors[k].gradient, gradient[0], gradient[1], gradient[2]);
      addTo(border[2].translation, loaded(factors[k].gradient.translation));
      addTo(border[2].rotation, loaded(factors[k].gradient.rotation));
      for (int other = 0; other <= k; ++other)
        subtractProduct(own, factors[other].Y, blocks[indexOf(factors[k].pose, factors[other].pose)].columns);
    }

    addCalibration(sums, disparity * disparity, by_offset, by_bend, *calibration_hessian);
    eliminated->calibration_gradient << disparity * sums.residual - sumOf(by_offset * gradient),
        disparity * sums.shape_residual - sumOf(by_bend * gradient);
    *calibration_gradient += eliminated->calibration_gradient;

    eliminated->factors = moving;
    keep(sums, R, gradient, by_offset, by_bend, *eliminated);
  }

 private:
  /// What a point says of the calibration, less what it is in itself.
  static SDVO_IN_KERNEL void addCalibration(const PointSums& sums, double square, const Three& by_offset,
                                            const Three& by_bend, RigCalibration::Matrix& hessian) {
    hessian(0, 0) += square * sums.weight - sumOf(by_offset * by_offset);
    hessian(1, 0) += square * sums.shape - sumOf(by_bend * by_offset);
    hessian(1, 1) += square * sums.shape_square - sumOf(by_bend * by_bend);
  }

  /// What moves the point later, and what its disparities tell.
  static SDVO_IN_KERNEL void keep(const PointSums& sums, const InverseRoot& R, const Three& gradient,
                                  const Three& by_offset, const Three& by_bend, EliminatedPoint& eliminated) {
    for (int k = 0; k < 3; ++k) {
      eliminated.R.row(k) << R.column0[k], R.column1[k], R.column2[k];
      eliminated.gradient[k] = gradient[k];
      eliminated.by_calibration.col(k) << by_offset[k], by_bend[k];
    }
    eliminated.observations = sums.observations;
    eliminated.weight = sums.weight;
    eliminated.disparity_residual = sums.residual;
    eliminated.disparity_by_point << sums.by0[2], sums.by1[2], sums.by2[2];
  }

  /// What an observation says of its pose, of that and the calibration, and of that and the point.
  static SDVO_IN_KERNEL void addPose(const Lever& lever, const Derivatives& A, const PredictedObservation& at, double w,
                                     const double* T, PoseFactor& factor, PoseEquations::Block& block,
                                     PoseEquations::Border& border) {
    const Information M(A, w);
    const double by_z = -w * A.ahead[2];  // the disparity by P.z
    lever.multiply(M.times(T), factor.Y[0]);
    lever.multiply(M.times(T + 4), factor.Y[1]);
    lever.multiply(M.times(T + 12) + kZ * (by_z * A.by_rho), factor.Y[2]);

    // Of the block's upper right part nobody asks.
    const Three& P = lever.P;
    lever.addProduct(M.x, lever.rho, block.columns[0]);
    lever.addProduct(M.y, lever.rho, block.columns[1]);
    lever.addProduct(M.z, lever.rho, block.columns[2]);
    addTo(block.columns[3].rotation, cross(P, P[1] * M.z - P[2] * M.y));
    addTo(block.columns[4].rotation, cross(P, P[2] * M.x - P[0] * M.z));
    addTo(block.columns[5].rotation, cross(P, P[0] * M.y - P[1] * M.x));

    const Three of_disparity = kZ * (by_z * at.inverse_noise[2]);
    lever.addProduct(of_disparity, 1.0, border.columns[0]);
    lever.addProduct(of_disparity, at.shape, border.columns[1]);
    lever.multiply(A.transposedTimes(w * at.residual), factor.gradient);
  }

  /// A factor by R^T from the right.
  static SDVO_IN_KERNEL void multiply(const InverseRoot& R, PoseFactor& factor) {
    const FactorColumns W(factor);
    store(W.translation0 * R.column0[0], factor.Y[0].translation);
    store(W.rotation0 * R.column0[0], factor.Y[0].rotation);
    store(W.translation0 * R.column0[1] + W.translation1 * R.column1[1], factor.Y[1].translation);
    store(W.rotation0 * R.column0[1] + W.rotation1 * R.column1[1], factor.Y[1].rotation);
    store(W.translation0 * R.column0[2] + W.translation1 * R.column1[2] + W.translation2 * R.column2[2],
          factor.Y[2].translation);
    store(W.rotation0 * R.column0[2] + W.rotation1 * R.column1[2] + W.rotation2 * R.column2[2], factor.Y[2].rotation);
  }

  static SDVO_IN_KERNEL void subtractProduct(const FactorColumns& own, const PoseVector* Y, PoseVector* columns) {
    for (int c = 0; c < 3; ++c)
      own.subtractFrom(columns[c], Y[0].translation[c], Y[1].translation[c], Y[2].translation[c]);
    for (int c = 0; c < 3; ++c) own.subtractFrom(columns[3 + c], Y[0].rotation[c], Y[1].rotation[c], Y[2].rotation[c]);
  }
};

/// movePoints(). What a point is still off by, times R, goes back by R^T.
struct MovePoints {
  static SDVO_IN_KERNEL void run(const EliminatedPoint* points, std::size_t count, const PoseFactor* factor,
                                 const PoseVector* pose_steps, const double* calibration_step, double* moved) {
    for (std::size_t p = 0; p < count; ++p) {
      const EliminatedPoint& point = points[p];
      Three by_poses[3] = {};
      for (const PoseFactor* end = factor + point.factors; factor != end; ++factor) {
        const Three translation = loaded(pose_steps[factor->pose].translation);
        const Three rotation = loaded(pose_steps[factor->pose].rotation);
        for (int k = 0; k < 3; ++k)
          by_poses[k] += loaded(factor->Y[k].translation) * translation + loaded(factor->Y[k].rotation) * rotation;
      }
      double off[3];
      for (int k = 0; k < 3; ++k)
        off[k] = point.gradient[k] - sumOf(by_poses[k]) -
                 (point.by_calibration(0, k) * calibration_step[0] + point.by_calibration(1, k) * calibration_step[1]);
      for (int k = 0; k < 3; ++k)
        moved[3 * p + static_cast<std::size_t>(k)] +=
            point.R(0, k) * off[0] + point.R(1, k) * off[1] + point.R(2, k) * off[2];
    }
  }
};

Vector6d bothHalves(const PoseVector& v) {
  Vector6d both;
  both << v.translation[0], v.translation[1], v.translation[2], v.rotation[0], v.rotation[1], v.rotation[2];
  return both;
}

}  // namespace

WindowProjection::WindowProjection(const StereoCamera& camera, const RigCalibration& calibration)
    : focal{camera.fx, camera.fy, camera.fx * camera.baseline, 0.0},
      centre{camera.cx, camera.cy, calibration.value[0], 0.0},
      bend(calibration.value[1]) {}

void squareResiduals(const WindowProjection& projection, const ObservedPoint& point, double* squares) {
  runKernel<SquareObservations>(&projection, &point, squares);
}

void movePoints(const std::vector<EliminatedPoint>& points, const std::vector<PoseFactor>& factors,
                const Eigen::VectorXd& pose_steps, const RigCalibration::Vector& calibration_step,
                std::vector<Eigen::Vector3d>& ray_and_inverse_depth) {
  if (points.empty()) return;
  std::vector<PoseVector> steps(static_cast<std::size_t>(pose_steps.size() / 6));
  for (std::size_t f = 0; f < steps.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      steps[f].translation[k] = pose_steps[6 * static_cast<Eigen::Index>(f) + k];
      steps[f].rotation[k] = pose_steps[6 * static_cast<Eigen::Index>(f) + 3 + k];
    }
  runKernel<MovePoints>(points.data(), points.size(), factors.data(), steps.data(), calibration_step.data(),
                        ray_and_inverse_depth.data()->data());
}

void PoseEquations::setZero(int poses) {
  blocks_.assign(indexOf(poses, 0), Block{});
  borders_.assign(static_cast<std::size_t>(poses), Border{});
  calibration_hessian_.setZero();
  calibration_gradient_.setZero();
}

EliminatedPoint PoseEquations::add(const WindowProjection& projection, const ObservedPoint& point,
                                   const Linearisation& linearisation, PoseFactor* factors, double* squares) {
  EliminatedPoint eliminated;
  runKernel<AddPoint>(&projection, &point, &linearisation, factors, squares, blocks_.data(), borders_.data(),
                      &eliminated, &calibration_hessian_, &calibration_gradient_);
  return eliminated;
}

void PoseEquations::copyTo(Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient) const {
  const int poses = static_cast<int>(borders_.size()), c = 6 * poses;
  hessian.setZero(c + kCalibration, c + kCalibration);
  gradient.resize(c + kCalibration);
  for (int row = 0; row < poses; ++row) {
    for (int column = 0; column <= row; ++column)
      for (int k = 0; k < 6; ++k)
        hessian.block<6, 1>(6 * row, 6 * column + k) = bothHalves(blocks_[indexOf(row, column)].columns[k]);
    const Border& border = borders_[static_cast<std::size_t>(row)];
    for (int k = 0; k < kCalibration; ++k)
      hessian.block<1, 6>(c + k, 6 * row) = bothHalves(border.columns[k]).transpose();
    gradient.segment<6>(6 * row) = bothHalves(border.columns[kCalibration]);
  }
  hessian.bottomRightCorner<kCalibration, kCalibration>() = calibration_hessian_;
  gradient.tail<kCalibration>() = calibration_gradient_;
}

}  // namespace sdvo
