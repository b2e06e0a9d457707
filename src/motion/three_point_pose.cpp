#include "three_point_pose.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "stereo_descriptor_vo/common/se3.hpp"

// Persson and Nordberg, "Lambda Twist: An Accurate Fast Robust Perspective Three Point (P3P) Solver", ECCV 2018. The
// distances lambda along the rays fulfil three equations, one for each side of the triangle:
//   lambda_i^2 + lambda_j^2 - 2 cosine_ij lambda_i lambda_j = side_ij^2
// Two combinations of them are homogeneous. A degenerate one among their sums is a pair of planes through the origin,
// and each plane leaves a quadratic equation.

namespace sdvo {
namespace {

/// Squares of the triangle's sides and cosines between the rays, for the pairs 12, 13 and 23.
struct Triangle {
  double a12, a13, a23;
  double b12, b13, b23;
};

/// A root of x^3 + b x^2 + c x + d, the one farthest from the others.
double cubicRoot(double b, double c, double d) {
  // With x = y - b / 3: y^3 + p y + q.
  const double shift = b / 3.0, p = c - b * shift, q = d + shift * (2.0 * shift * shift - c);
  const double discriminant = 0.25 * q * q + p * p * p / 27.0;
  double y;
  if (discriminant >= 0.0) {
    const double larger = std::cbrt(-0.5 * q - std::copysign(std::sqrt(discriminant), q));
    y = larger == 0.0 ? 0.0 : larger - p / (3.0 * larger);
  } else {
    const double radius = std::sqrt(-p / 3.0);
    const double cosine = std::clamp(-0.5 * q / (radius * radius * radius), -1.0, 1.0);
    y = std::copysign(2.0 * radius * std::cos(std::acos(std::abs(cosine)) / 3.0), cosine);
  }
  double x = y - shift;
  for (int step = 0; step < 2; ++step) {
    const double slope = (3.0 * x + 2.0 * b) * x + c;
    if (slope == 0.0) break;
    x -= (((x + b) * x + c) * x + d) / slope;
  }
  return x;
}

/// The two planes whose product a degenerate quadratic form is (Richter-Gebert, Perspectives on Projective Geometry,
/// section 11.1); false where they are not real.
bool splitIntoPlanes(const Eigen::Matrix3d& form, Eigen::Vector3d& first, Eigen::Vector3d& second) {
  Eigen::Matrix3d adjugate;
  for (int k = 0; k < 3; ++k) adjugate.col(k) = form.col((k + 1) % 3).cross(form.col((k + 2) % 3));
  int i, j;
  if (adjugate.diagonal().minCoeff(&i) >= 0.0) return false;
  const Eigen::Matrix3d product = form - skew(adjugate.col(i) / std::sqrt(-adjugate(i, i)));
  product.cwiseAbs().maxCoeff(&i, &j);
  first = product.row(i);
  second = product.col(j);
  return true;
}

/// The planes in which the distances along the rays lie. False if there are none.
bool findPlanes(const Triangle& t, std::array<Eigen::Vector3d, 2>& planes) {
  // The equations of sides 12 and 13, each combined with that of side 23 so that the constants cancel.
  Eigen::Matrix3d first, second;
  first << t.a23, -t.a23 * t.b12, 0.0,               //
      -t.a23 * t.b12, t.a23 - t.a12, t.a12 * t.b23,  //
      0.0, t.a12 * t.b23, -t.a12;
  second << t.a23, 0.0, -t.a23 * t.b13,  //
      0.0, -t.a13, t.a13 * t.b23,        //
      -t.a23 * t.b13, t.a13 * t.b23, t.a23 - t.a13;
  // det(first + gamma second) is a cubic of gamma.
  const auto determinant = [](const Eigen::Matrix3d& a, const Eigen::Matrix3d& b, const Eigen::Matrix3d& c) {
    return a.col(0).dot(b.col(1).cross(c.col(2)));
  };
  const double c3 = second.determinant(), c0 = first.determinant();
  const double c2 =
      determinant(first, second, second) + determinant(second, first, second) + determinant(second, second, first);
  const double c1 =
      determinant(second, first, first) + determinant(first, second, first) + determinant(first, first, second);
  // Symmetric triangles have no cubic term: the roots' inverses are those of second + first / gamma.
  const bool is_inverse = std::abs(c3) < std::abs(c0);
  const double root = is_inverse ? cubicRoot(c1 / c0, c2 / c0, c3 / c0) : cubicRoot(c2 / c3, c1 / c3, c0 / c3);
  const Eigen::Matrix3d degenerate = is_inverse ? second + root * first : first + root * second;
  return std::isfinite(root) && splitIntoPlanes(degenerate, planes[0], planes[1]);
}

/// Distances along the rays on one of the planes, four at most with those of the other.
void appendDistances(const Triangle& t, const Eigen::Vector3d& plane, UpToFour<Eigen::Vector3d>& distances) {
  const auto secondDistance = [&](double ratio) { return std::sqrt(t.a23 / (1.0 + ratio * (ratio - 2.0 * t.b23))); };
  constexpr double kParallel = 1e-9;  // the plane holds the first axis: a symmetric triangle
  if (std::abs(plane[0]) < kParallel * plane.norm()) {
    const double ratio = -plane[1] / plane[2], l2 = secondDistance(ratio);
    const double half = std::sqrt(t.a12 - l2 * l2 * (1.0 - t.b12 * t.b12));
    for (const double l1 : {t.b12 * l2 - half, t.b12 * l2 + half}) distances.add({l1, l2, ratio * l2});
    return;
  }
  // lambda1 = w0 lambda2 + w1 lambda3, and the ratio lambda3 / lambda2 from sides 12 and 13.
  const double w0 = -plane[1] / plane[0], w1 = -plane[2] / plane[0];
  const double a = (t.a13 - t.a12) * w1 * w1 + 2.0 * t.a12 * t.b13 * w1 - t.a12;
  const double b = (t.a13 - t.a12) * w0 * w1 - t.a13 * t.b12 * w1 + t.a12 * t.b13 * w0;
  const double c = (t.a13 - t.a12) * w0 * w0 - 2.0 * t.a13 * t.b12 * w0 + t.a13;
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0.0)) return;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  for (const double ratio : {q / a, c / q}) {
    const double l2 = secondDistance(ratio);
    distances.add({(w0 + w1 * ratio) * l2, l2, ratio * l2});
  }
}

/// Gauss-Newton steps on the three equations.
void polish(const Triangle& t, Eigen::Vector3d& lambda) {
  constexpr int kSteps = 2;
  for (int step = 0; step < kSteps; ++step) {
    const double l1 = lambda[0], l2 = lambda[1], l3 = lambda[2];
    const Eigen::Vector3d error(l1 * l1 + l2 * l2 - 2.0 * t.b12 * l1 * l2 - t.a12,
                                l1 * l1 + l3 * l3 - 2.0 * t.b13 * l1 * l3 - t.a13,
                                l2 * l2 + l3 * l3 - 2.0 * t.b23 * l2 * l3 - t.a23);
    Eigen::Matrix3d jacobian;
    jacobian << l1 - t.b12 * l2, l2 - t.b12 * l1, 0.0,  //
        l1 - t.b13 * l3, 0.0, l3 - t.b13 * l1,          //
        0.0, l2 - t.b23 * l3, l3 - t.b23 * l2;
    const Eigen::Vector3d change = 0.5 * (jacobian.inverse() * error);
    if (!change.allFinite()) return;
    lambda -= change;
  }
}

}  // namespace

PoseCandidates solveThreePointPose(const std::array<Eigen::Vector3d, 3>& points,
                                   const std::array<Eigen::Vector3d, 3>& rays) {
  PoseCandidates candidates;
  const Eigen::Vector3d side12 = points[0] - points[1], side13 = points[0] - points[2];
  const Eigen::Vector3d normal = side12.cross(side13);
  const Triangle t{side12.squaredNorm(), side13.squaredNorm(), (points[1] - points[2]).squaredNorm(),
                   rays[0].dot(rays[1]), rays[0].dot(rays[2]), rays[1].dot(rays[2])};
  constexpr double kFlat = 1e-12;  // square of the sine at the first point
  if (!(normal.squaredNorm() > kFlat * t.a12 * t.a13)) return candidates;

  std::array<Eigen::Vector3d, 2> planes;
  if (!findPlanes(t, planes)) return candidates;

  Eigen::Matrix3d in_reference;
  in_reference << side12, side13, normal;
  const Eigen::Matrix3d from_reference = in_reference.inverse();
  UpToFour<Eigen::Vector3d> distances;
  for (const Eigen::Vector3d& plane : planes) appendDistances(t, plane, distances);
  const auto isAhead = [](const Eigen::Vector3d& lambda) { return lambda.allFinite() && lambda.minCoeff() > 0.0; };
  for (Eigen::Vector3d lambda : distances) {
    if (!isAhead(lambda)) continue;
    polish(t, lambda);
    if (!isAhead(lambda)) continue;
    const Eigen::Vector3d seen = lambda[0] * rays[0];
    const Eigen::Vector3d seen12 = seen - lambda[1] * rays[1], seen13 = seen - lambda[2] * rays[2];
    Eigen::Matrix3d in_camera;
    in_camera << seen12, seen13, seen12.cross(seen13);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = in_camera * from_reference;
    T.translation() = seen - T.linear() * points[0];
    candidates.add(T);
  }
  return candidates;
}

}  // namespace sdvo
