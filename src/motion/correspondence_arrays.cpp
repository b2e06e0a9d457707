#include "correspondence_arrays.hpp"

#include <cstddef>
#include <limits>

#include "projected.hpp"

namespace sdvo {
namespace {

struct SquareResiduals {
  static SDVO_IN_KERNEL void run(const Projection* projection, const double* values, std::ptrdiff_t stride, int count,
                                 double* squares) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const DoubleLanes infinite = {kInfinity, kInfinity, kInfinity, kInfinity};
    for (int k = 0; k < count; k += CorrespondenceArrays::kLanes) {
      const Projected at(*projection, values + k, stride);
      const DoubleLanes square = at.u_left * at.u_left + (at.v * at.v + at.u_right * at.u_right);
      store(DoubleLanes(at.behind ? infinite : square), squares + k);
    }
  }
};

/// Sums of the Hessian's upper triangle, and of the gradient.
struct Sums {
  DoubleLanes hessian[6 * 6]{}, gradient[6]{};
};

struct SumEquations {
  static SDVO_IN_KERNEL void run(const Projection* projection, const double* values, std::ptrdiff_t stride, int count,
                                 const double* weights, Sums* result) {
    const Projection& p = *projection;
    Sums sums;
    for (int k = 0; k < count; k += CorrespondenceArrays::kLanes) {
      const Projected at(p, values + k, stride);
      DoubleLanes weight;
      load(weights + k, weight);
      // The rows of the Jacobian are (a, 0, c, c y, a z - c x, -a y) for both u, which differ in c, and
      // (0, b, c, c y - b z, -c x, b x) for v.
      const DoubleLanes a = p.fx * at.inverse_depth, b = p.fy * at.inverse_depth;
      const DoubleLanes left = -a * at.x * at.inverse_depth;
      const DoubleLanes right = left + p.fx_baseline * at.inverse_depth * at.inverse_depth;
      const DoubleLanes down = -b * at.y * at.inverse_depth;
      const DoubleLanes of_left[] = {a, left, left * at.y, a * at.z - left * at.x, -a * at.y};
      const DoubleLanes of_right[] = {a, right, right * at.y, a * at.z - right * at.x, -a * at.y};
      const DoubleLanes of_v[] = {b, down, down * at.y - b * at.z, -down * at.x, b * at.x};
      addRow<6>(of_left, {0, 2, 3, 4, 5}, weight, at.u_left, sums.hessian, sums.gradient);
      addRow<6>(of_right, {0, 2, 3, 4, 5}, weight, at.u_right, sums.hessian, sums.gradient);
      addRow<6>(of_v, {1, 2, 3, 4, 5}, weight, at.v, sums.hessian, sums.gradient);
    }
    *result = sums;
  }
};

}  // namespace

CorrespondenceArrays::CorrespondenceArrays(const std::vector<Correspondence>& correspondences)
    : count_(static_cast<int>(correspondences.size())), values_(static_cast<std::size_t>(6 * roundedUp(count_)), 0.0) {
  const std::ptrdiff_t stride = roundedUp(count_);
  double* values = values_.data();
  for (const Correspondence& correspondence : correspondences) {
    for (int k = 0; k < 3; ++k) {
      values[k * stride] = correspondence.point[k];
      values[(3 + k) * stride] = correspondence.measurement[k];
    }
    ++values;
  }
}

void CorrespondenceArrays::squareResiduals(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference,
                                           int first, int count, double* squares) const {
  const Projection projection(camera, T_current_reference);
  runKernel<SquareResiduals>(&projection, values_.data() + first, std::ptrdiff_t{roundedUp(count_)}, count, squares);
}

void CorrespondenceArrays::sumEquations(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference,
                                        const double* weights, Matrix6d& hessian, Vector6d& gradient) const {
  const Projection projection(camera, T_current_reference);
  Sums sums;
  const int count = roundedUp(count_);
  runKernel<SumEquations>(&projection, values_.data(), std::ptrdiff_t{count}, count, weights, &sums);
  for (int i = 0; i < 6; ++i) {
    gradient[i] = total(sums.gradient[i]);
    for (int j = i; j < 6; ++j) hessian(i, j) = hessian(j, i) = total(sums.hessian[6 * i + j]);
  }
}

}  // namespace sdvo
