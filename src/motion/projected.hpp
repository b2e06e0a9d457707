#pragma once

#include <Eigen/Geometry>
#include <cstddef>

#include "../common/kernel.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo {

/// Pose and camera as plain numbers, for the kernels.
struct Projection {
  double rotation[3][3], translation[3];
  double fx, fy, cx, cy, fx_baseline, nearest;

  Projection(const StereoCamera& camera, const Eigen::Isometry3d& T)
      : fx(camera.fx),
        fy(camera.fy),
        cx(camera.cx),
        cy(camera.cy),
        fx_baseline(camera.fx * camera.baseline),
        nearest(camera.nearestDepth()) {
    for (int i = 0; i < 3; ++i) {
      translation[i] = T.translation()[i];
      for (int j = 0; j < 3; ++j) rotation[i][j] = T.linear()(i, j);
    }
  }
};

/// Four correspondences under a pose, as reprojectionResidual() has them one by one.
struct Projected {
  DoubleLanes x, y, z;                   ///< in the camera's frame, m
  DoubleLanes inverse_depth;             ///< 1/m
  DoubleLanes u_left, v, u_right;        ///< residuals, px
  decltype(DoubleLanes{} < 0.0) behind;  ///< not in front of the camera: then z is 1 m

  SDVO_IN_KERNEL Projected(const Projection& p, const double* values, std::ptrdiff_t stride) {
    DoubleLanes px, py, pz, measured;
    load(values, px), load(values + stride, py), load(values + 2 * stride, pz);
    x = p.rotation[0][0] * px + p.rotation[0][1] * py + p.rotation[0][2] * pz + p.translation[0];
    y = p.rotation[1][0] * px + p.rotation[1][1] * py + p.rotation[1][2] * pz + p.translation[1];
    z = p.rotation[2][0] * px + p.rotation[2][1] * py + p.rotation[2][2] * pz + p.translation[2];
    behind = z < p.nearest;
    z = behind ? DoubleLanes{1.0, 1.0, 1.0, 1.0} : z;
    inverse_depth = 1.0 / z;
    const DoubleLanes u = p.fx * x * inverse_depth + p.cx;
    load(values + 3 * stride, measured);
    u_left = measured - u;
    load(values + 4 * stride, measured);
    v = measured - (p.fy * y * inverse_depth + p.cy);
    load(values + 5 * stride, measured);
    u_right = measured - (u - p.fx_baseline * inverse_depth);
  }
};

/// Adds a residual's equations to the upper triangle of the Hessian, which has kSize rows of kSize numbers, and to the
/// gradient. The row of the Jacobian is zero but in these columns.
template <int kSize, int kCount>
SDVO_IN_KERNEL void addRow(const DoubleLanes (&row)[kCount], const int (&columns)[kCount], const DoubleLanes& weight,
                           const DoubleLanes& residual, DoubleLanes* hessian, DoubleLanes* gradient) {
#pragma GCC unroll 6
  for (int i = 0; i < kCount; ++i) {
    const DoubleLanes weighted = weight * row[i];
    gradient[columns[i]] += weighted * residual;
#pragma GCC unroll 6
    for (int j = i; j < kCount; ++j) hessian[kSize * columns[i] + columns[j]] += weighted * row[j];
  }
}

/// The sum of all lanes in a fixed order.
inline double total(const DoubleLanes& lanes) {
  return (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
}

}  // namespace sdvo
