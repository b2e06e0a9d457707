#include <gtest/gtest.h>

#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo::test_stereo_camera {

TEST(StereoCamera, ProjectsByHand) {
  const StereoCamera camera{100.0, 200.0, 50.0, 60.0, 0.5, 100, 120};
  // x/z = 0.25, y/z = -0.125; the right camera sees x - 0.5.
  const Eigen::Vector3d pixel = camera.project({1.0, -0.5, 4.0});
  EXPECT_NEAR(pixel.x(), 75.0, 1e-12);
  EXPECT_NEAR(pixel.y(), 35.0, 1e-12);
  EXPECT_NEAR(pixel.z(), 62.5, 1e-12);
  EXPECT_NEAR(camera.depth(12.5), 4.0, 1e-12);
  EXPECT_NEAR(camera.disparity(4.0), 12.5, 1e-12);
}

TEST(StereoCamera, BackProjectionInvertsProjection) {
  const StereoCamera camera = synthetic::camera();
  for (const double x : {-7.0, 0.0, 3.1})
    for (const double y : {-2.0, 0.4})
      for (const double z : {0.6, 5.0, 80.0}) {
        const Eigen::Vector3d point(x, y, z), pixel = camera.project(point);
        const Eigen::Vector3d back = camera.backProject(pixel[0], pixel[1], pixel[0] - pixel[2]);
        EXPECT_LT((back - point).norm(), 1e-9 * (1.0 + point.norm()) * z) << point.transpose();
      }
}

TEST(StereoCamera, JacobianIsTheDerivative) {
  const StereoCamera camera = synthetic::camera();
  const Eigen::Vector3d point(1.3, -0.7, 6.0);
  const Eigen::Matrix3d jacobian = camera.projectionJacobian(point);
  constexpr double kStep = 1e-5;  // m; central differences err by its square
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    const Eigen::Vector3d difference = (camera.project(point + step) - camera.project(point - step)) / (2.0 * kStep);
    EXPECT_LT((jacobian.col(axis) - difference).norm(), 1e-5) << "axis " << axis;
  }
}

TEST(StereoCamera, CheckRefusesWhatNoCameraHas) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  Refusals<StereoCamera> refusals = {{[](StereoCamera& c) { c.width = 0; }, "size"},
                                     {[](StereoCamera& c) { c.height = 0; }, "size"},
                                     {[](StereoCamera& c) { c = {}; }, ""}};
  for (const double bad : {kNaN, kInf, 0.0, -400.0}) {
    refusals.emplace_back([bad](StereoCamera& c) { c.fx = bad; }, "fx");
    refusals.emplace_back([bad](StereoCamera& c) { c.fy = bad; }, "fy");
    refusals.emplace_back([bad](StereoCamera& c) { c.baseline = bad; }, "baseline");
    if (std::isfinite(bad)) continue;
    refusals.emplace_back([bad](StereoCamera& c) { c.cx = bad; }, "principal point");
    refusals.emplace_back([bad](StereoCamera& c) { c.cy = bad; }, "principal point");
  }
  expectRefusals(
      synthetic::camera(), [](const StereoCamera& camera) { camera.check(); }, refusals);
}

TEST(StereoCamera, EqualityLooksAtEveryField) {
  EXPECT_EQ(synthetic::camera(), synthetic::camera());
  for (double StereoCamera::*field :
       {&StereoCamera::fx, &StereoCamera::fy, &StereoCamera::cx, &StereoCamera::cy, &StereoCamera::baseline}) {
    StereoCamera camera = synthetic::camera();
    camera.*field += 1e-6;
    EXPECT_NE(camera, synthetic::camera());
  }
  for (int StereoCamera::*field : {&StereoCamera::width, &StereoCamera::height}) {
    StereoCamera camera = synthetic::camera();
    camera.*field += 1;
    EXPECT_NE(camera, synthetic::camera());
  }
}

}  // namespace sdvo::test_stereo_camera
