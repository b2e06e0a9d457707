#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "../../src/map/point_elimination.hpp"
#include "../../src/map/window_optimizer.hpp"
#include "../synthetic_features.hpp"

namespace sdvo::test_point_elimination {

constexpr double kDamping = 1e-3;
constexpr Linearisation kLinearisation = {2.0, kDamping};
constexpr double kLeastInformation = 1e-9;  // that a point is given of itself
constexpr double kDisparitySigma = 0.25;    // px
constexpr int kPoses = 4;                   // that may move

/// A point seen by the cameras of a short drive, somewhere else than it is thought to be.
struct Scene {
  StereoCamera camera = SyntheticScene(1, 0, 10.0).camera;
  RigCalibration calibration;
  AnchoredPoint point;
  std::vector<Eigen::Isometry3d> T_camera_origin, T_camera_anchor;
  std::vector<WindowObservation> observations;

  explicit Scene(const std::vector<int>& frames, const Eigen::Vector3d& where = {0.4, -0.2, 1.0 / 9.0}) {
    calibration.value << 0.2, -0.7, 0.4;
    point.T_origin_anchor = syntheticPose(-2);
    point.ray_and_inverse_depth = where;
    for (int f = 0; f <= kPoses; ++f) T_camera_origin.push_back(syntheticPose(f).inverse());
    for (const auto& T : T_camera_origin) T_camera_anchor.push_back(T * point.T_origin_anchor);
    for (const int frame : frames) {
      Eigen::Vector3d seen =
          predictObservation(camera, T_camera_origin[frame], point).value_or(Eigen::Vector3d(600.0, 180.0, 20.0));
      seen += Eigen::Vector3d(0.3 * std::sin(3.0 * frame), 0.4 * std::cos(5.0 * frame), 0.2 + 0.1 * frame);
      observations.push_back({{seen, 0.1 + 0.05 * frame}, 0, frame});
    }
  }

  ObservedPoint observed() const {
    return {point.ray_and_inverse_depth, observations.data(), static_cast<int>(observations.size()),
            1.0 / kDisparitySigma, T_camera_anchor.data()};
  }
};

/// Derivatives of predictObservation() by the left perturbation of the pose and by the point.
struct Jacobians {
  Eigen::Matrix<double, 3, 6> pose;
  Eigen::Matrix3d point;
};

Jacobians jacobiansOf(const StereoCamera& camera, const Eigen::Isometry3d& T_camera_origin,
                      const AnchoredPoint& point) {
  const double rho = point.ray_and_inverse_depth.z();
  const Eigen::Vector3d P = point.scaledPointIn(T_camera_origin);
  const double iz = 1.0 / P.z();
  const double x = P.x() * iz, y = P.y() * iz, fb = camera.fx * camera.baseline;
  const Eigen::Isometry3d T_camera_anchor = T_camera_origin * point.T_origin_anchor;
  // By the scaled point, rho held: (a, 0, -a x), (0, b, -b y), (0, 0, -d). A turn moves the point by -skew(P).
  const double a = camera.fx * iz, b = camera.fy * iz, d = fb * rho * iz * iz;
  Jacobians jacobians;
  jacobians.pose << rho * a, 0.0, -rho * a * x, -a * x * P.y(), a * (P.z() + x * P.x()), -a * P.y(),  //
      0.0, rho * b, -rho * b * y, -b * (P.z() + y * P.y()), b * y * P.x(), b * P.x(),                 //
      0.0, 0.0, -rho * d, -d * P.y(), d * P.x(), 0.0;
  const auto byDirection = [&](const auto& w) -> Eigen::Vector3d {
    return {a * (w.x() - x * w.z()), b * (w.y() - y * w.z()), -d * w.z()};
  };
  jacobians.point.col(0) = byDirection(T_camera_anchor.linear().col(0));
  jacobians.point.col(1) = byDirection(T_camera_anchor.linear().col(1));
  jacobians.point.col(2) = byDirection(T_camera_anchor.translation());
  jacobians.point(2, 2) += fb * iz;
  return jacobians;
}

TEST(PredictObservation, JacobiansAgreeWithFiniteDifferences) {
  constexpr double kStep = 1e-6;
  const StereoCamera camera = SyntheticScene(1, 0, 10.0).camera;
  AnchoredPoint point;
  point.T_origin_anchor = syntheticPose(2);
  point.ray_and_inverse_depth = {0.3, 0.1, 0.08};
  const Eigen::Isometry3d T = syntheticPose(6).inverse();
  const Jacobians jacobians = jacobiansOf(camera, T, point);
  for (int axis = 0; axis < 6; ++axis) {
    const auto at = [&](double step) {
      return predictObservation(camera, expSE3(step * Vector6d::Unit(axis)) * T, point).value();
    };
    EXPECT_LT((jacobians.pose.col(axis) - (at(kStep) - at(-kStep)) / (2 * kStep)).norm(), 1e-4) << "pose axis " << axis;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [&](double step) {
      AnchoredPoint moved = point;
      moved.ray_and_inverse_depth[axis] += step;
      return predictObservation(camera, T, moved).value();
    };
    EXPECT_LT((jacobians.point.col(axis) - (at(kStep) - at(-kStep)) / (2 * kStep)).norm(), 1e-4)
        << "point axis " << axis;
  }
}

/// Residuals and Jacobians of one observation by all that may move: poses, calibration, point.
struct Row {
  Eigen::Vector3d residual;
  Eigen::MatrixXd jacobian;
  double weight, square;
};

std::vector<Row> rowsOf(const Scene& scene, double bend = kLinearisation.bend) {
  std::vector<Row> rows;
  for (const WindowObservation& seen : scene.observations) {
    const Eigen::Isometry3d& T = scene.T_camera_origin[seen.frame];
    auto prediction = predictObservation(scene.camera, T, scene.point);
    if (!prediction) continue;
    const Jacobians jacobians = jacobiansOf(scene.camera, T, scene.point);
    const Eigen::Vector3d& measured = seen.measurement;
    const Eigen::Vector3d noise(1.0 / seen.sigma, 1.0 / seen.sigma, 1.0 / kDisparitySigma);
    prediction->z() += scene.calibration.disparityError(scene.camera, measured.x(), measured.y());
    Row row;
    row.residual = noise.cwiseProduct(measured - *prediction);
    row.square = row.residual.squaredNorm();
    row.weight = 1.0 / (1.0 + row.square / bend);
    row.jacobian.setZero(3, 6 * kPoses + kCalibration + 3);
    if (seen.frame > 0) row.jacobian.middleCols<6>(6 * (seen.frame - 1)) = jacobians.pose;
    row.jacobian.row(2).segment<kCalibration>(6 * kPoses) =
        RigCalibration::shape(scene.camera, measured.x(), measured.y());
    row.jacobian.rightCols<3>() = jacobians.point;
    row.jacobian = noise.asDiagonal() * row.jacobian;
    rows.push_back(row);
  }
  return rows;
}

/// Weighted normal equations of everything.
struct Whole {
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(6 * kPoses + kCalibration + 3, 6 * kPoses + kCalibration + 3);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(6 * kPoses + kCalibration + 3);

  explicit Whole(const Scene& scene) {
    for (const Row& row : rowsOf(scene)) {
      hessian += row.weight * row.jacobian.transpose() * row.jacobian;
      gradient += row.weight * row.jacobian.transpose() * row.residual;
    }
    hessian.bottomRightCorner<3, 3>().diagonal() *= 1.0 + kDamping;
    hessian.bottomRightCorner<3, 3>().diagonal().array() += kLeastInformation;
  }
};

/// Of what add() makes of a scene.
struct Reduced {
  PoseEquations equations;
  std::vector<PoseFactor> factors;
  std::vector<double> squares;
  EliminatedPoint point;
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;

  explicit Reduced(const Scene& scene) : factors(scene.observations.size()), squares(scene.observations.size()) {
    equations.setZero(kPoses);
    point = equations.add({scene.camera, scene.calibration}, scene.observed(), kLinearisation, factors.data(),
                          squares.data());
    equations.writeHessian(hessian);
    gradient = equations.gradient();
  }
};

void expectNear(const Eigen::MatrixXd& value, const Eigen::MatrixXd& expected, const char* what) {
  ASSERT_EQ(value.rows(), expected.rows()) << what;
  EXPECT_LT((value - expected).cwiseAbs().maxCoeff(), 1e-9 * (1.0 + expected.cwiseAbs().maxCoeff())) << what;
}

void expectSchurComplement(const Scene& scene) {
  const Whole whole(scene);
  const Reduced reduced(scene);
  const int n = 6 * kPoses + kCalibration;
  const Eigen::Matrix3d inverse = whole.hessian.bottomRightCorner<3, 3>().inverse();
  const Eigen::MatrixXd with_point = whole.hessian.topRightCorner(n, 3);
  const Eigen::MatrixXd expected = whole.hessian.topLeftCorner(n, n) - with_point * inverse * with_point.transpose();
  expectNear(Eigen::MatrixXd(reduced.hessian.triangularView<Eigen::Lower>()),
             Eigen::MatrixXd(expected.triangularView<Eigen::Lower>()), "hessian");
  expectNear(reduced.gradient, whole.gradient.head(n) - with_point * inverse * whole.gradient.tail<3>(), "gradient");
}

TEST(PointElimination, IsTheSchurComplementOfTheNormalEquations) {
  for (const std::vector<int>& frames : {std::vector<int>{0, 1, 2, 3, 4}, {1, 3, 4}, {0, 2}, {4}})
    expectSchurComplement(Scene(frames));
  expectSchurComplement(Scene({0, 1, 2, 3, 4}, {0.1, 0.05, 0.0}));  // so far that it is a direction
}

TEST(PointElimination, GradientsOfSightingsAndPointsAddUp) {
  const Reduced reduced(Scene({0, 1, 2, 4}));
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(reduced.gradient.size());
  for (int k = 0; k < reduced.point.factors; ++k) {
    const PoseFactor& factor = reduced.factors[static_cast<std::size_t>(k)];
    sum.segment<6>(6 * factor.pose) += factor.gradient.head<6>();
  }
  sum.tail<kCalibration>() = reduced.point.calibration_gradient;
  expectNear(sum, reduced.gradient, "gradient");
  const Eigen::Matrix<double, 6, Eigen::Dynamic> by = Eigen::MatrixXd::Random(6, sum.size());
  std::vector<FactorColumn> moved(1);
  sumGradients({reduced.point}, reduced.factors, by, moved);
  expectNear(moved[0].head<6>(), by * sum, "gradient times a matrix");
}

TEST(PointElimination, SightingsFromBehindCostButDoNotPull) {
  // 3.5 m ahead of the anchor, which lies 2 m before the first camera: the last three have passed it.
  const Scene scene({0, 1, 2, 3, 4}, {0.1, 0.05, 1.0 / 3.5});
  ASSERT_EQ(rowsOf(scene).size(), 2u);
  expectSchurComplement(scene);
  const Reduced reduced(scene);
  EXPECT_EQ(reduced.point.observations, 2);
  EXPECT_EQ(reduced.point.factors, 1);
  EXPECT_LT(reduced.squares[1], kBehindSquare);
  for (int i = 2; i < 5; ++i) EXPECT_EQ(reduced.squares[i], kBehindSquare) << i;
}

/// Some step of the poses, then of the calibration.
Eigen::VectorXd someStep() {
  Eigen::VectorXd step(6 * kPoses + kCalibration);
  for (int i = 0; i < step.size(); ++i) step[i] = 0.01 * std::sin(1.0 + i);
  return step;
}

/// The points of several scenes after that step.
std::vector<Eigen::Vector3d> movedPoints(const std::vector<Scene>& scenes) {
  std::vector<EliminatedPoint> points;
  std::vector<PoseFactor> factors;
  std::vector<Eigen::Vector3d> moved;
  for (const Scene& scene : scenes) {
    const Reduced reduced(scene);
    points.push_back(reduced.point);
    factors.insert(factors.end(), reduced.factors.begin(), reduced.factors.begin() + reduced.point.factors);
    moved.push_back(scene.point.ray_and_inverse_depth);
  }
  const Eigen::VectorXd step = someStep();
  movePoints(points, factors, step.head(6 * kPoses), step.tail<kCalibration>(), moved);
  return moved;
}

TEST(PointElimination, PointsFollowAsTheWholeEquationsSay) {
  const std::vector<Scene> scenes = {Scene({0, 1, 2, 4}), Scene({0}), Scene({3, 4}, {-0.3, 0.1, 1.0 / 20.0})};
  const std::vector<Eigen::Vector3d> moved = movedPoints(scenes);
  const Eigen::VectorXd step = someStep();
  for (std::size_t p = 0; p < scenes.size(); ++p) {
    const Whole whole(scenes[p]);
    const Eigen::Vector3d expected = whole.hessian.bottomRightCorner<3, 3>().llt().solve(
        Eigen::Vector3d(whole.gradient.tail<3>() - whole.hessian.bottomLeftCorner(3, step.size()) * step));
    expectNear(moved[p] - scenes[p].point.ray_and_inverse_depth, expected, "point");
  }
}

TEST(PointElimination, SumsUpWhatItsSightingsSay) {
  const Scene scene({0, 1, 3});
  const Reduced reduced(scene);
  double weight = 0.0, residual = 0.0;
  Eigen::Vector3d by_point = Eigen::Vector3d::Zero();
  const std::vector<Row> rows = rowsOf(scene);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    weight += rows[i].weight;
    residual += rows[i].weight * rows[i].residual.z();
    by_point += rows[i].weight * rows[i].jacobian.row(2).tail<3>().transpose();
    EXPECT_NEAR(reduced.squares[i], rows[i].square, 1e-9 * rows[i].square) << i;
  }
  EXPECT_NEAR(reduced.point.weight, weight, 1e-9);
  EXPECT_NEAR(reduced.point.disparity_residual, residual, 1e-9);
  expectNear(reduced.point.disparity_by_point, by_point, "derivatives of the disparities");
}

TEST(PointElimination, SquaresAreThoseOfTheEquations) {
  const Scene scene({0, 1, 2, 3, 4}, {0.1, 0.05, 1.0 / 3.5});
  std::vector<double> squares(5);
  squareResiduals({scene.camera, scene.calibration}, scene.observed(), squares.data());
  EXPECT_EQ(squares, Reduced(scene).squares);
}

TEST(PointElimination, PointsAddUp) {
  const Scene one({0, 1, 2, 3}), other({1, 2, 4}, {-0.3, 0.1, 1.0 / 20.0});
  PoseEquations equations;
  equations.setZero(kPoses);
  std::vector<PoseFactor> factors(4);
  std::vector<double> squares(4);
  for (const Scene* scene : {&one, &other})
    equations.add({scene->camera, scene->calibration}, scene->observed(), kLinearisation, factors.data(),
                  squares.data());
  const Reduced alone(one), other_alone(other);
  Eigen::MatrixXd hessian;
  equations.writeHessian(hessian);
  expectNear(Eigen::MatrixXd(hessian.triangularView<Eigen::Lower>()),
             Eigen::MatrixXd((alone.hessian + other_alone.hessian).triangularView<Eigen::Lower>()), "hessian");
  expectNear(equations.gradient(), alone.gradient + other_alone.gradient, "gradient");
}

}  // namespace sdvo::test_point_elimination
