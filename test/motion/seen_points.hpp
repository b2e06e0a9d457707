#pragma once

#include "../../src/motion/correspondence_arrays.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// A car's step with some turn.
inline Eigen::Isometry3d trueMotion() {
  return expSE3((Vector6d() << 0.1, -0.05, -0.9, 0.01, 0.03, -0.02).finished());
}

/// Points seen before and after trueMotion(), and those that are no outliers by construction.
struct SeenPoints {
  StereoCamera camera = synthetic::camera();
  std::vector<Correspondence> correspondences;
  std::vector<int> inliers;
};

/// Gaussian noise, px, on all that the second pair measures; outliers, a share from the first point on, are measured
/// somewhere else in the image, at least 15 px from the truth.
inline SeenPoints seenPoints(unsigned seed, int count, double noise = 0.0, double outlier_share = 0.0) {
  SeenPoints seen;
  const StereoCamera& camera = seen.camera;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d share = synthetic::draw<3>(uniform, random);
    const Eigen::Vector3d point =
        camera.backProject(40.0 + 560.0 * share.x(), 40.0 + 400.0 * share.y(), 6.0 + 30.0 * share.z());
    Eigen::Vector3d measurement = camera.project(trueMotion() * point);
    for (int k = 0; k < 3; ++k) measurement[k] += noise * normal(random);
    if (i < outlier_share * count) {
      const double angle = 2.0 * CV_PI * uniform(random), distance = 15.0 + 200.0 * uniform(random);
      measurement += Eigen::Vector3d(distance * std::cos(angle), distance * std::sin(angle),
                                     distance * std::cos(angle) + 20.0 * normal(random));
    } else {
      seen.inliers.push_back(i);
    }
    seen.correspondences.push_back({point, measurement});
  }
  return seen;
}

}  // namespace sdvo
