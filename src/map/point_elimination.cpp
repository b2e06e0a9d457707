#include "point_elimination.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "../common/kernel.hpp"
#include "map_point.hpp"

namespace sdvo {
namespace {

/// Measurement minus prediction (as by predictObservation()) of a point in one camera, divided by the noise.
struct WindowResidual {
  Eigen::Vector3d P;  ///< scaled point in the camera's frame
  Eigen::Vector3d inverse_noise;
  Eigen::Vector3d value;
  RigCalibration::RowVector shape;
  double square;

  WindowResidual(const WindowProjection& projection, const ObservedPoint& point, const WindowObservation& seen) {
    const StereoCamera& camera = projection.camera;
    const Eigen::Isometry3d& T = point.T_camera_anchor[seen.frame];
    const Eigen::Vector3d& ray = point.ray_and_inverse_depth;
    P = T.linear().col(0) * ray.x() + T.linear().col(1) * ray.y() + T.linear().col(2) + T.translation() * ray.z();
    shape = RigCalibration::shape(camera, seen.measurement.x(), seen.measurement.y());
    inverse_noise << 1.0 / seen.sigma, 1.0 / seen.sigma, point.inverse_disparity_sigma;
    const double iz = 1.0 / P.z();
    const Eigen::Vector3d predicted(
        camera.cx + camera.fx * P.x() * iz, camera.cy + camera.fy * P.y() * iz,
        camera.fx * camera.baseline * ray.z() * iz + shape.dot(projection.calibration.value));
    value = inverse_noise.cwiseProduct(seen.measurement - predicted);
    square = isInFront() ? value.squaredNorm() : kBehindSquare;
  }
  bool isInFront() const { return P.z() >= kNearestScaled; }
};

constexpr int kLanes = 4;

/// An observation's derivatives by its pose, divided by the noise and times the root of its weight: a column for each
/// number of the measurement.
struct WeightedJacobians {
  double by_pose[3][kFactorRows] = {};
  double by_point[3][kLanes] = {};  ///< a row for each number of the measurement, and a zero

  SDVO_IN_KERNEL WeightedJacobians(const WindowProjection& projection, double rho, const WindowResidual& at,
                                   const Eigen::Isometry3d& T, double root) {
    const double *P = at.P.data(), *R = T.matrix().data(), iz = 1.0 / P[2];  // of T four rows, column by column
    const double a = root * projection.camera.fx * iz * at.inverse_noise[0];
    const double b = root * projection.camera.fy * iz * at.inverse_noise[1];
    const double c = root * projection.camera.fx * projection.camera.baseline * iz * at.inverse_noise[2];
    const double d = c * rho * iz, x = P[0] * iz, y = P[1] * iz;
    // The rows by P at constant rho are (a, 0, -a x), (0, b, -b y) and (0, 0, -d). A perturbation (t, w) of the pose
    // moves P by rho t + w x P.
    double *u = by_pose[0], *v = by_pose[1], *disparity = by_pose[2];
    u[0] = rho * a, u[2] = -rho * a * x, u[3] = -a * x * P[1], u[4] = a * (P[2] + x * P[0]), u[5] = -a * P[1];
    v[1] = rho * b, v[2] = -rho * b * y, v[3] = -b * (P[2] + y * P[1]), v[4] = b * y * P[0], v[5] = b * P[0];
    disparity[2] = -rho * d, disparity[3] = -d * P[1], disparity[4] = d * P[0];
    constexpr int kColumns[] = {0, 4, 12};  // the ray's x and y turn with the camera, the inverse depth moves with it
    for (int k = 0; k < 3; ++k) {
      const double* moved = R + kColumns[k];
      by_point[0][k] = a * (moved[0] - x * moved[2]);
      by_point[1][k] = b * (moved[1] - y * moved[2]);
      by_point[2][k] = -d * moved[2];
    }
    by_point[2][2] += c;
    for (auto& column : by_pose) column[6] = column[0], column[7] = column[1];
  }
};

/// block += sign a b^T for blocks of six columns, each with kLanes rows, which lie in memory one after the other.
template <int kTerms, int kSign>
SDVO_IN_KERNEL void addProduct(const double* a, const double* b, double* block) {
  DoubleLanes of_a[kTerms];
  for (int m = 0; m < kTerms; ++m) load(a + kLanes * m, of_a[m]);
  for (int k = 0; k < 6; ++k) {
    DoubleLanes sum;
    load(block + kLanes * k, sum);
    for (int m = 0; m < kTerms; ++m) {
      const DoubleLanes product = of_a[m] * b[kFactorRows * m + k];
      sum = kSign > 0 ? sum + product : sum - product;
    }
    store(sum, block + kLanes * k);
  }
}

/// Three columns of a pose, each number in as many lanes as a product of 6x6 takes it. Two columns of the product, rows
/// 0 to 5, fill three registers of four lanes:
///   0 1 2 3 | 4 5 0 1 | 2 3 4 5
///   first column   | second column
class SpreadColumns {
 public:
  SDVO_IN_KERNEL explicit SpreadColumns(const double* columns) {
    const auto is_first = DoubleLanes{0.0, 0.0, 1.0, 1.0} < 0.5;
#pragma GCC unroll 3
    for (int m = 0; m < 3; ++m)
#pragma GCC unroll 3
      for (int k = 0; k < 3; ++k) {
        const double a = columns[kFactorRows * m + 2 * k], b = columns[kFactorRows * m + 2 * k + 1];
        const DoubleLanes first = {a, a, a, a}, second = {b, b, b, b};
        values_[m][k][0] = first, values_[m][k][1] = is_first ? first : second, values_[m][k][2] = second;
      }
  }

  /// block += sign a b^T, where b are these columns and block is 6x6, column by column.
  template <int kSign>
  SDVO_IN_KERNEL void addProduct(const double* a, double* block) const {
    constexpr int kRowOf[] = {0, 4, 2};  // at which a register begins; `a` has rows 0 and 1 again after row 5
    DoubleLanes of_a[3][3];
    for (int m = 0; m < 3; ++m)
      for (int i = 0; i < 3; ++i) load(a + kFactorRows * m + kRowOf[i], of_a[m][i]);
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i, block += kLanes) {
        DoubleLanes sum;
        load(block, sum);
        for (int m = 0; m < 3; ++m) {
          const DoubleLanes product = of_a[m][i] * values_[m][k][i];
          sum = kSign > 0 ? sum + product : sum - product;
        }
        store(sum, block);
      }
  }

 private:
  DoubleLanes values_[3][3][3];
};

/// Columns of kFactorRows numbers times a 3x3 matrix that is given row by row.
SDVO_IN_KERNEL void multiply(const double* columns, const double (&matrix)[3][kLanes], double* products) {
  for (int row = 0; row < kFactorRows; row += kLanes) {
    DoubleLanes a, b, c;
    load(columns + row, a), load(columns + kFactorRows + row, b), load(columns + 2 * kFactorRows + row, c);
    for (int k = 0; k < 3; ++k)
      store(a * matrix[0][k] + b * matrix[1][k] + c * matrix[2][k], products + kFactorRows * k + row);
  }
}

/// sums += sign times columns of kFactorRows numbers times a vector.
template <int kSign>
SDVO_IN_KERNEL void addTimes(const double* columns, const double* vector, double* sums) {
  for (int row = 0; row < kFactorRows; row += kLanes) {
    DoubleLanes sum, a, b, c;
    load(sums + row, sum);
    load(columns + row, a), load(columns + kFactorRows + row, b), load(columns + 2 * kFactorRows + row, c);
    const DoubleLanes product = a * vector[0] + b * vector[1] + c * vector[2];
    store(kSign > 0 ? sum + product : sum - product, sums + row);
  }
}

/// Inverse of the Cholesky factor of a matrix, of which the lower triangle is given. Squares on its diagonal are at
/// least `least`, because rounding may make them negative.
SDVO_IN_KERNEL void invertRoot(const double (&H)[3][kLanes], const double (&least)[3], double (&R)[3][3]) {
  R[0][1] = R[0][2] = R[1][2] = 0.0;
  R[0][0] = 1.0 / std::sqrt(std::max(H[0][0], least[0]));
  const double l10 = H[1][0] * R[0][0], l20 = H[2][0] * R[0][0];
  R[1][1] = 1.0 / std::sqrt(std::max(H[1][1] - l10 * l10, least[1]));
  const double l21 = (H[2][1] - l20 * l10) * R[1][1];
  R[2][2] = 1.0 / std::sqrt(std::max(H[2][2] - l20 * l20 - l21 * l21, least[2]));
  R[1][0] = -l10 * R[0][0] * R[1][1];
  R[2][1] = -l21 * R[1][1] * R[2][2];
  R[2][0] = -(l20 * R[0][0] + l21 * R[1][0]) * R[2][2];
}

/// sumGradients(), with `by` filled up to kFactorRows.
struct SumGradients {
  static SDVO_IN_KERNEL void run(const EliminatedPoint* points, std::size_t count, const PoseFactor* factor,
                                 const double* by, const double* by_calibration, FactorColumn* sums) {
    for (std::size_t p = 0; p < count; ++p) {
      DoubleLanes low{}, high{};
      add<kCalibration>(by_calibration, points[p].calibration_gradient.data(), low, high);
      for (const PoseFactor* end = factor + points[p].factors; factor != end; ++factor)
        add<6>(by + 6 * kFactorRows * factor->pose, factor->gradient.data(), low, high);
      store(low, sums[p].data()), store(high, sums[p].data() + kLanes);
    }
  }

  template <int kColumns>
  static SDVO_IN_KERNEL void add(const double* columns, const double* vector, DoubleLanes& low, DoubleLanes& high) {
    for (int k = 0; k < kColumns; ++k, columns += kFactorRows) {
      DoubleLanes first, second;
      load(columns, first), load(columns + kLanes, second);
      low += first * vector[k], high += second * vector[k];
    }
  }
};

}  // namespace

/// PoseEquations::add() as a kernel.
struct AddPoint {
  SDVO_IN_KERNEL static void run(const WindowProjection* projection, const ObservedPoint* point,
                                 const Linearisation* linearisation, PoseEquations* equations, PoseFactor* factors,
                                 double* squares, EliminatedPoint* result) {
    constexpr double kLeastInformation = 1e-9;  // keeps H invertible if no observation constrains a direction
    const double rho = point->ray_and_inverse_depth.z();
    // With poses x, the point p and the calibration c, the equations have the blocks H_xx, H_xp, H_pp and so on.
    // 1. Sum over the observations, a lane for each number of p or c: H_pp, H_cp, H_cc and the gradients. H_xx and H_xc
    // are added to the equations at once; H_xp = J_pose^T W J_point is kept in the factors.
    DoubleLanes sum_pp[3] = {}, sum_p = {}, sum_cp[3] = {}, sum_dp = {}, sum_cc[3] = {}, sum_c = {};
    double weight = 0.0, disparity_residual = 0.0;
    int observations = 0, count = 0;
    for (int i = 0; i < point->count; ++i) {
      const WindowObservation& seen = point->observations[i];
      const WindowResidual at(*projection, *point, seen);
      squares[i] = at.square;
      if (!at.isInFront()) continue;
      const double w = linearisation->bend / (linearisation->bend + at.square), root = std::sqrt(w);
      const WeightedJacobians J(*projection, rho, at, point->T_camera_anchor[seen.frame], root);
      const double residual[3] = {root * at.value[0], root * at.value[1], root * at.value[2]};
      double shape[kLanes] = {};  // changes disparities alone
      for (int k = 0; k < kCalibration; ++k) shape[k] = root * at.inverse_noise[2] * at.shape[k];
      DoubleLanes row[3], shapes;
      for (int m = 0; m < 3; ++m) load(J.by_point[m], row[m]);
      load(shape, shapes);
      for (int k = 0; k < 3; ++k) {
        for (int m = 0; m < 3; ++m) sum_pp[k] += row[m] * J.by_point[m][k];
        sum_p += row[k] * residual[k];
        sum_cp[k] += shapes * J.by_point[2][k];
        sum_cc[k] += shapes * shape[k];
      }
      sum_c += shapes * residual[2];
      sum_dp += row[2] * root;
      weight += w;
      disparity_residual += root * residual[2];
      ++observations;
      if (seen.frame == 0) continue;
      PoseFactor& factor = factors[count++];
      factor.pose = seen.frame - 1;
      multiply(J.by_pose[0], J.by_point, factor.Y.data());
      factor.gradient.setZero();
      addTimes<1>(J.by_pose[0], residual, factor.gradient.data());
      SpreadColumns(J.by_pose[0]).addProduct<1>(J.by_pose[0], equations->H_xx(factor.pose, factor.pose));
      addProduct<1, 1>(shape, J.by_pose[2], equations->H_cx_[factor.pose].values);
    }
    double H_pp[3][kLanes], g_p[kLanes], H_cp[3][kLanes], g_c[kLanes], disparity_by_point[kLanes];
    double H_cc[3][kLanes];
    for (int k = 0; k < 3; ++k) store(sum_pp[k], H_pp[k]), store(sum_cp[k], H_cp[k]), store(sum_cc[k], H_cc[k]);
    store(sum_p, g_p), store(sum_c, g_c), store(sum_dp, disparity_by_point);

    // 2. Factor H_pp, damped: R = L^-1. `reduced` is R g_p.
    const double baseline = projection->camera.baseline;
    // The inverse depth is in 1/m: the square of the baseline scales its information.
    const double least[3] = {kLeastInformation, kLeastInformation, kLeastInformation * baseline * baseline};
    for (int k = 0; k < 3; ++k) H_pp[k][k] = H_pp[k][k] * (1.0 + linearisation->damping) + least[k];
    double R[3][3];
    invertRoot(H_pp, least, R);
    const double transposed[3][kLanes] = {{R[0][0], R[1][0], R[2][0]}, {0.0, R[1][1], R[2][1]}, {0.0, 0.0, R[2][2]}};
    double reduced[3], reduced_calibration[3][kLanes] = {};
    for (int k = 0; k < 3; ++k) {
      reduced[k] = R[k][0] * g_p[0] + R[k][1] * g_p[1] + R[k][2] * g_p[2];
      for (int l = 0; l < kCalibration; ++l)
        reduced_calibration[k][l] = R[k][0] * H_cp[0][l] + R[k][1] * H_cp[1][l] + R[k][2] * H_cp[2][l];
    }
    // 3. Schur complement: subtract H_cp H_pp^-1 H_pc and H_cp H_pp^-1 g_p, with H_pp^-1 = R^T R.
    const Eigen::Index tail = equations->gradient_.size() - kCalibration;
    for (int k = 0; k < kCalibration; ++k) {
      for (int m = 0; m < 3; ++m) {
        g_c[k] -= reduced_calibration[m][k] * reduced[m];
        for (int l = 0; l <= k; ++l) H_cc[k][l] -= reduced_calibration[m][k] * reduced_calibration[m][l];
      }
      equations->gradient_[tail + k] += g_c[k];
      for (int l = 0; l <= k; ++l) equations->H_cc_(k, l) += H_cc[k][l];
    }

    // 4. The same for poses: Y = H_xp R^T, and subtract the products of the Y of each two poses, Y R H_pc and Y R g_p.
    for (int k = 0; k < count; ++k) {
      PoseFactor& factor = factors[k];
      double* Y = factor.Y.data();
      multiply(Y, transposed, Y);
      addTimes<-1>(Y, reduced, factor.gradient.data());
      addProduct<3, -1>(reduced_calibration[0], Y, equations->H_cx_[factor.pose].values);
      for (int i = 0; i < 6; ++i) equations->gradient_[6 * factor.pose + i] += factor.gradient[i];
    }
    for (int other = 0; other < count; ++other) {
      const SpreadColumns columns(factors[other].Y.data());
      for (int k = other; k < count; ++k)
        columns.addProduct<-1>(factors[k].Y.data(), equations->H_xx(factors[k].pose, factors[other].pose));
    }

    for (int k = 0; k < 3; ++k) {
      for (int l = 0; l < 3; ++l) result->R(k, l) = R[k][l], result->by_calibration(l, k) = reduced_calibration[k][l];
      result->gradient[k] = reduced[k];
      result->calibration_gradient[k] = g_c[k];
      result->disparity_by_point[k] = disparity_by_point[k];
    }
    result->factors = count, result->observations = observations;
    result->weight = weight, result->disparity_residual = disparity_residual;
  }
};

void squareResiduals(const WindowProjection& projection, const ObservedPoint& point, double* squares) {
  for (int i = 0; i < point.count; ++i) squares[i] = WindowResidual(projection, point, point.observations[i]).square;
}

void movePoints(const std::vector<EliminatedPoint>& points, const std::vector<PoseFactor>& factors,
                const Eigen::VectorXd& pose_steps, const RigCalibration::Vector& calibration_step,
                std::vector<Eigen::Vector3d>& ray_and_inverse_depth) {
  const PoseFactor* factor = factors.data();
  for (std::size_t p = 0; p < points.size(); ++p) {
    Eigen::Vector3d rest = points[p].gradient - points[p].by_calibration.transpose() * calibration_step;
    for (const PoseFactor* end = factor + points[p].factors; factor != end; ++factor)
      rest.noalias() -= factor->Y.topRows<6>().transpose() * pose_steps.segment<6>(6 * factor->pose);
    ray_and_inverse_depth[p].noalias() += points[p].R.transpose() * rest;
  }
}

void sumGradients(const std::vector<EliminatedPoint>& points, const std::vector<PoseFactor>& factors,
                  const Eigen::Matrix<double, 6, Eigen::Dynamic>& by, std::vector<FactorColumn>& sums) {
  Eigen::Matrix<double, kFactorRows, Eigen::Dynamic> filled =
      Eigen::Matrix<double, kFactorRows, Eigen::Dynamic>::Zero(kFactorRows, by.cols());
  filled.topRows<6>() = by;
  runKernel<SumGradients>(points.data(), points.size(), factors.data(), filled.data(),
                          filled.rightCols<kCalibration>().data(), sums.data());
}

void PoseEquations::setZero(int poses) {
  H_xx_.assign(static_cast<std::size_t>(poses * (poses + 1) / 2), {});
  H_cx_.assign(static_cast<std::size_t>(poses), {});
  H_cc_.setZero();
  gradient_.setZero(6 * poses + kCalibration);
}

EliminatedPoint PoseEquations::add(const WindowProjection& projection, const ObservedPoint& point,
                                   const Linearisation& linearisation, PoseFactor* factors, double* squares) {
  EliminatedPoint result;
  runKernel<AddPoint>(&projection, &point, &linearisation, this, factors, squares, &result);
  return result;
}

void PoseEquations::writeHessian(Eigen::MatrixXd& hessian) const {
  const Eigen::Index poses = static_cast<Eigen::Index>(H_cx_.size());
  hessian.setZero(gradient_.size(), gradient_.size());
  const PoseBlock* block = H_xx_.data();
  for (Eigen::Index row = 0; row < poses; ++row)
    for (Eigen::Index column = 0; column <= row; ++column, ++block)
      hessian.block<6, 6>(6 * row, 6 * column) = Eigen::Map<const Eigen::Matrix<double, 6, 6>>(block->values);
  for (Eigen::Index pose = 0; pose < poses; ++pose)
    hessian.block<kCalibration, 6>(6 * poses, 6 * pose) =
        Eigen::Map<const Eigen::Matrix<double, CalibrationBlock::kRows, 6>>(
            H_cx_[static_cast<std::size_t>(pose)].values)
            .topRows<kCalibration>();
  hessian.bottomRightCorner<kCalibration, kCalibration>() = H_cc_;
}

}  // namespace sdvo
