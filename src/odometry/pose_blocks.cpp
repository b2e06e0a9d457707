#include "pose_blocks.hpp"

#include <cstddef>
#include <cstring>

#include "../common/kernel.hpp"

namespace sdvo {
namespace {

constexpr int kRows = 6;  // of a pose

/// Six doubles worked on at once: two registers with AVX, three without.
struct Column {
  typedef double Head __attribute__((vector_size(32)));
  typedef double Tail __attribute__((vector_size(16)));
  Head head;
  Tail tail;

  SDVO_IN_KERNEL void load(const double* values) {
    std::memcpy(&head, values, sizeof head);
    std::memcpy(&tail, values + 4, sizeof tail);
  }
  SDVO_IN_KERNEL void store(double* values) const {
    std::memcpy(values, &head, sizeof head);
    std::memcpy(values + 4, &tail, sizeof tail);
  }
  SDVO_IN_KERNEL void add(const Column& other) { head += other.head, tail += other.tail; }
  SDVO_IN_KERNEL void subtract(const Column& other) { head -= other.head, tail -= other.tail; }
};

/// Three columns: a pose's derivatives of three numbers.
struct Columns {
  Column of[3];

  SDVO_IN_KERNEL explicit Columns(const double* values) {
    for (int k = 0; k < 3; ++k) of[k].load(values + kRows * k);
  }
  /// Their sum, weighted.
  SDVO_IN_KERNEL void combine(double a, double b, double c, Column& sum) const {
    sum.head = of[0].head * a + of[1].head * b + of[2].head * c;
    sum.tail = of[0].tail * a + of[1].tail * b + of[2].tail * c;
  }
  /// Their product with a 3x3 matrix.
  SDVO_IN_KERNEL void multiply(const double* matrix, double* product) const {
    Column column;
    for (int k = 0; k < 3; ++k) {
      combine(matrix[3 * k], matrix[3 * k + 1], matrix[3 * k + 2], column);
      column.store(product + kRows * k);
    }
  }
};

struct AddEliminatedPoint {
  static SDVO_IN_KERNEL void run(const WeightedSighting* sightings, int count, const PointProducts* point,
                                 double* hessian, int stride, double* gradient) {
    Column product, sum;
    for (int a = 0; a < count; ++a) {
      const WeightedSighting& sighting = sightings[a];
      double* own = point->pose_point + 3 * kRows * a;
      double* own_scaled = point->scaled + 3 * kRows * a;
      double* own_gradient = gradient + kRows * sighting.pose;
      double* own_rows = hessian + kRows * sighting.pose;
      const Columns by_pose(sighting.by_pose);
      by_pose.multiply(sighting.by_point, own);
      Columns(own).multiply(point->inverse_hessian, own_scaled);
      const Columns scaled(own_scaled);

      sum.load(own_gradient);
      by_pose.combine(sighting.residual[0], sighting.residual[1], sighting.residual[2], product);
      sum.add(product);
      scaled.combine(point->gradient[0], point->gradient[1], point->gradient[2], product);
      sum.subtract(product);
      sum.store(own_gradient);

      for (int b = 0; b <= a; ++b) {
        const double* other = point->pose_point + 3 * kRows * b;
        double* block = own_rows + static_cast<std::ptrdiff_t>(kRows * sightings[b].pose) * stride;
        for (int k = 0; k < kRows; ++k, block += stride) {
          sum.load(block);
          if (a == b) {
            by_pose.combine(sighting.by_pose[k], sighting.by_pose[kRows + k], sighting.by_pose[2 * kRows + k], product);
            sum.add(product);
          }
          scaled.combine(other[k], other[kRows + k], other[2 * kRows + k], product);
          sum.subtract(product);
          sum.store(block);
        }
      }
    }
  }
};

}  // namespace

void addEliminatedPoint(const WeightedSighting* sightings, int count, const PointProducts& point, double* hessian,
                        int stride, double* gradient) {
  runKernel<AddEliminatedPoint>(sightings, count, &point, hessian, stride, gradient);
}

}  // namespace sdvo
