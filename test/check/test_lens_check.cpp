#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "../../src/check/lens_check.hpp"
#include "../said.hpp"

namespace sdvo::test_lens_check {

const StereoCamera kTrue{400.0, 400.0, 320.0, 200.0, 0.1, 640, 400};

/// Pairs of a camera that turns by some degrees, or goes straight ahead, seen by `kTrue` with 0.2 px of noise and a
/// tenth of movers, and judged by another camera's numbers. `focus`: change of fx with each pair, px.
Finding judged(StereoCamera told, bool turns = true, double focus = 0.0) {
  LensCheck check;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(0.0, 640.0), v(0.0, 400.0), disparity(2.0, 30.0), any(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.2);
  for (int pair = 0; pair < 40; ++pair) {
    told.fx += pair % 2 == 0 ? focus : -focus;
    Eigen::Isometry3d T_previous_current = Eigen::Isometry3d::Identity();
    T_previous_current.translation() = Eigen::Vector3d(0.01 * any(random), 0.01 * any(random), 0.1);
    if (turns)
      T_previous_current.linear() = (Eigen::AngleAxisd(0.04 * std::sin(0.3 * pair), Eigen::Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(0.02 * std::cos(0.4 * pair), Eigen::Vector3d::UnitX()))
                                        .toRotationMatrix();
    std::vector<LensCheck::Track> tracks;
    for (int i = 0; i < 100; ++i) {
      const LensCheck::Track now{u(random), v(random), disparity(random), 0.0, 0.0};
      Eigen::Vector3d before = kTrue.project(T_previous_current * kTrue.backProject(now.u, now.v, now.disparity));
      if (i % 10 == 0) before += 10.0 * Eigen::Vector3d(any(random), any(random), 0.0);
      tracks.push_back({now.u + noise(random), now.v + noise(random), now.disparity + noise(random),
                        before.x() + noise(random), before.y() + noise(random)});
    }
    check.add(told, tracks);
  }
  return check.judge();
}

StereoCamera scaled(double f, double dx, double dy) {
  StereoCamera camera = kTrue;
  camera.fx *= f, camera.fy *= f, camera.cx += dx, camera.cy += dy;
  return camera;
}

TEST(LensCheck, WhatCameraInfoDoesNotHaveOfTheImagesIsNamed) {
  struct Case {
    double f, dx, dy;
    Verdict verdict;
    const char* words;
  };
  for (const Case& c :
       {Case{1.0, 0.0, 0.0, Verdict::kOk, "focal length 1.0"}, Case{1.02, 5.0, -5.0, Verdict::kOk, ""},
        Case{1.0 / 1.1, 0.0, 0.0, Verdict::kWarn, "focal length 1.10"},
        Case{0.75, 0.0, 0.0, Verdict::kWarn, "focal length 1.3"},
        Case{1.5, 0.0, 0.0, Verdict::kWarn, "focal length 0.6"}, Case{1.0, 0.0, 80.0, Verdict::kWarn, "cy off by -8"},
        Case{1.0, -160.0, -100.0, Verdict::kWarn, "cx off by 1"}}) {
    const Finding finding = judged(scaled(c.f, c.dx, c.dy));
    EXPECT_EQ(finding.verdict, c.verdict) << finding.what;
    EXPECT_TRUE(contains(finding.what, c.words)) << finding.what;
  }
}

TEST(LensCheck, AnAutofocusIsJudgedToo) {
  EXPECT_EQ(judged(kTrue, true, 0.5).verdict, Verdict::kOk);
  EXPECT_EQ(judged(scaled(0.75, 0.0, 0.0), true, 0.5).verdict, Verdict::kWarn);
}

TEST(LensCheck, AWayStraightAheadShowsNothing) {
  for (const double f : {1.0, 1.3}) EXPECT_EQ(judged(scaled(f, 0.0, 0.0), false).verdict, Verdict::kOpen) << f;
  EXPECT_EQ(LensCheck().judge().verdict, Verdict::kOpen);
}

}  // namespace sdvo::test_lens_check
