#include <gtest/gtest.h>

#include "../../src/motion/rig_calibration.hpp"

namespace sdvo::test_rig_calibration {

TEST(RigCalibration, IsAnOffsetABendThatGrowsToBothSidesAndATilt) {
  const StereoCamera camera{400.0, 410.0, 320.0, 240.0, 0.5, 1120, 480};
  RigCalibration calibration;
  calibration.value << 0.25, -2.0, 1.0;
  EXPECT_DOUBLE_EQ(calibration.disparityError(camera, 320.0, 240.0), 0.25);
  // Half the focal length from the middle, then 45 degrees; a bend is the same on both sides.
  EXPECT_DOUBLE_EQ(calibration.disparityError(camera, 520.0, 240.0), 0.25 - 0.5);
  EXPECT_DOUBLE_EQ(calibration.disparityError(camera, 120.0, 240.0), 0.25 - 0.5);
  EXPECT_DOUBLE_EQ(calibration.disparityError(camera, 720.0, 240.0), 0.25 - 2.0);
  EXPECT_DOUBLE_EQ(calibration.disparityError(camera, 320.0, 445.0), 0.25 + 0.5);
  EXPECT_DOUBLE_EQ(calibration.disparityError(camera, 320.0, 35.0), 0.25 - 0.5);
}

TEST(RigCalibration, ShapeIsTheDerivative) {
  const StereoCamera camera{400.0, 410.0, 320.0, 240.0, 0.5, 1120, 480};
  for (const double u : {0.0, 100.0, 400.0, 1119.0}) {
    for (int k = 0; k < RigCalibration::kParameters; ++k) {
      RigCalibration calibration;
      calibration.value[k] = 1.0;
      EXPECT_DOUBLE_EQ(calibration.disparityError(camera, u, 100.0), RigCalibration::shape(camera, u, 100.0)[k]);
    }
  }
}

}  // namespace sdvo::test_rig_calibration
