#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "../../render/drive_renderer.hpp"
#include "../../render/plan_motion.hpp"
#include "../../render/preset_paths.hpp"
#include "../../render/rigs.hpp"

namespace sdvo::render::test_robot_drives {

constexpr double kDegree = M_PI / 180.0;
const std::vector<std::string> kMotions = {"hand_held", "turn_in_place", "corridor", "desk"};

/// Speeds of a path from frame to frame: the way and the turn by the time between them.
struct Speeds {
  std::vector<Eigen::Vector3d> linear, angular;  ///< m/s in the world and rad/s about the camera's axes
};

Speeds speedsOf(const DrivePath& path) {
  Speeds speeds;
  for (int i = 1; i < path.count(); ++i) {
    const Eigen::Isometry3d step = path.pose(i - 1).inverse() * path.pose(i);
    const Eigen::AngleAxisd turn(step.linear());
    speeds.linear.push_back(path.rate() * (path.pose(i).translation() - path.pose(i - 1).translation()));
    speeds.angular.push_back(path.rate() * turn.angle() * turn.axis());
  }
  return speeds;
}

double largest(const std::vector<Eigen::Vector3d>& values) {
  double result = 0.0;
  for (const Eigen::Vector3d& value : values) result = std::max(result, value.norm());
  return result;
}

/// How much an acceleration changes at most from one frame to the next.
double largestJump(const std::vector<Eigen::Vector3d>& speeds, double rate) {
  double result = 0.0;
  for (std::size_t i = 2; i < speeds.size(); ++i)
    result = std::max(result, rate * (speeds[i] - 2.0 * speeds[i - 1] + speeds[i - 2]).norm());
  return result;
}

TEST(RobotRigs, AnUnknownOneIsRefused) {
  EXPECT_THROW(findRig("nothing"), std::invalid_argument);
}

// There the quotient of time and step is rounded up, to a position that is not there yet.
TEST(PlanMotion, GoesOnRightBeforeAStep) {
  constexpr double kStep = 0.002, kSpeed = 0.8;
  for (int k = 1; k < 300; ++k) {
    PlanMotion motion;
    motion.advance({0.0, kSpeed, 0.5, 1e7});
    const double time = k * kStep, before = motion.at(std::nextafter(time, 0.0)).z;
    EXPECT_NEAR(before, PlanMotion(motion).at(time).z, 1e-12) << k;
  }
}

TEST(RobotMotions, StartAtRestAndAccelerateWithoutJumps) {
  for (const std::string& name : kMotions)
    for (const std::uint64_t seed : {1, 2}) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      const DrivePath coarse = makePresetPath(name, 20 * 200, 200.0, seed),
                      fine = makePresetPath(name, 20 * 400, 400.0, seed);
      EXPECT_LT((fine.pose(0).matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12);
      EXPECT_LT((fine.pose(200).matrix() - coarse.pose(100).matrix()).norm(), 1e-9) << "the rate changes nothing";
      const Speeds at_200 = speedsOf(coarse), at_400 = speedsOf(fine);
      EXPECT_LT(at_400.linear.front().norm(), 0.01);
      EXPECT_LT(at_400.angular.front().norm(), 0.01);
      // A continuous acceleration changes half as much in half the time, one with a jump as much.
      EXPECT_LT(largestJump(at_400.linear, 400.0), 0.65 * largestJump(at_200.linear, 200.0));
      EXPECT_LT(largestJump(at_400.angular, 400.0), 0.65 * largestJump(at_200.angular, 200.0));
    }
}

TEST(RobotMotions, AHandTurnsByAtMost100DegreesPerSecond) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Speeds speeds = speedsOf(makePresetPath("hand_held", 60 * 100, 100.0, seed));
    EXPECT_LT(largest(speeds.angular), 100.0 * kDegree);
    EXPECT_GT(largest(speeds.angular), 80.0 * kDegree);
    // 0.9 m/s ahead; bobbing, swaying and trembling add at most 0.35 m/s across.
    EXPECT_LT(largest(speeds.linear), 1.3);
    double sum = 0.0;
    for (const Eigen::Vector3d& speed : speeds.linear) sum += std::hypot(speed.x(), speed.z());
    EXPECT_NEAR(sum / static_cast<double>(speeds.linear.size()), 0.9, 0.1);
  }
}

TEST(RobotMotions, TurnsOnTheSpotMoveTheCameraAboutTheAxle) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const DrivePath path = makePresetPath("turn_in_place", 60 * 100, 100.0, seed);
    const Speeds speeds = speedsOf(path);
    double fastest = 0.0, turned = 0.0, driven = 0.0;
    for (std::size_t i = 0; i < speeds.linear.size(); ++i) {
      // Of the axle, 0.1 m behind the camera.
      const Eigen::Vector3d behind(0.0, 0.0, -0.1);
      const Eigen::Vector3d way = path.pose(static_cast<int>(i) + 1) * behind - path.pose(static_cast<int>(i)) * behind;
      const double rate = std::abs(speeds.angular[i].y()), speed = 100.0 * std::hypot(way.x(), way.z());
      fastest = std::max(fastest, rate);
      turned += rate / 100.0;
      driven += speed / 100.0;
      // The floor's bumps shake the camera by some mm/s.
      if (rate > 0.5) {
        EXPECT_LT(speed, 0.02) << i;
      }
      EXPECT_LT(speed, 0.52) << i;
    }
    EXPECT_NEAR(fastest, 1.0, 0.02);
    EXPECT_GT(turned, 20.0) << "rad in a minute";
    EXPECT_GT(driven, 4.0) << "m in a minute";
    for (const Eigen::Isometry3d& pose : path.poses()) EXPECT_LT(pose.translation().norm(), 2.0);
  }
}

TEST(RobotMotions, ACorridorIsDrivenAt80CentimetresPerSecondAndTurns) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const DrivePath path = makePresetPath("corridor", 40 * 100, 100.0, seed);
    const Speeds speeds = speedsOf(path);
    EXPECT_LT(largest(speeds.linear), 0.85);
    EXPECT_NEAR(path.distanceAt(40.0), 40.0 * 0.8, 1.0);
    // Right angles, one to each side. Bumps move the camera by 0.1 rad/s at most.
    double heading = 0.0, most = 0.0;
    for (const Eigen::Vector3d& rate : speeds.angular) {
      heading += rate.y() / 100.0;
      most = std::max(most, std::abs(heading));
    }
    EXPECT_LT(largest(speeds.angular), 0.95);
    EXPECT_NEAR(most, M_PI_2, 0.03);
  }
}

TEST(RobotMotions, ADeskIsLookedAtFromLittleSpace) {
  const DrivePath path = makePresetPath("desk", 60 * 20, 20.0, 1);
  Eigen::AlignedBox3d box;
  for (const Eigen::Isometry3d& pose : path.poses()) {
    box.extend(pose.translation());
    EXPECT_LT(Eigen::AngleAxisd(pose.linear()).angle(), 30.0 * kDegree);
  }
  EXPECT_LT(box.sizes().maxCoeff(), 0.5);
  EXPECT_GT(box.sizes().maxCoeff(), 0.2);
}

TEST(RobotMotions, PosesBetweenFramesAreKnown) {
  const DrivePath path = makePresetPath("hand_held", 100, 10.0, 1), fine = makePresetPath("hand_held", 1000, 100.0, 1);
  EXPECT_EQ(path.count(), 100);
  for (const int frame : {17, 40, 77}) {
    EXPECT_LT((path.pose(frame).matrix() - fine.pose(10 * frame).matrix()).norm(), 1e-9);
    EXPECT_LT((path.poseAt(0.1 * frame + 0.03).matrix() - fine.pose(10 * frame + 3).matrix()).norm(), 1e-5);
  }
  EXPECT_NEAR(path.distanceAt(5.0), fine.distanceAt(5.0), 0.01);
}

/// Some images of a drive of 10 s and their exact depths.
struct Shots {
  std::vector<cv::Mat1b> images;
  std::vector<cv::Mat1f> depths;
};

Shots shoot(const std::string& motion, const std::string& rig, int seed) {
  RenderOptions options;
  options.seed = seed;
  const DrivePath path = makePresetPath(motion, 200, 20.0, options.seed);
  const DriveRenderer renderer(path, *presetScenery(motion), findRig(rig).camera, options, 0, path.count(), 1);
  DriveRenderer::Worker worker = renderer.makeWorker();
  Shots shots;
  for (int frame = 0; frame < path.count(); frame += 40) {
    shots.images.push_back(renderer.render(frame, worker).left);
    shots.depths.push_back(renderer.truth(frame, worker).depth);
  }
  return shots;
}

double share(const cv::Mat1b& mask) {
  return cv::countNonZero(mask) / static_cast<double>(mask.total());
}

TEST(RobotWorlds, ShowSomethingInEveryImageAndNothingTooNear) {
  for (const std::string& motion : kMotions) {
    SCOPED_TRACE(motion);
    const Shots shots = shoot(motion, "d435_small", 1);
    for (std::size_t i = 0; i < shots.images.size(); ++i) {
      double nearest = 0.0;
      cv::minMaxLoc(shots.depths[i], &nearest);
      EXPECT_GT(nearest, 0.2) << i;
      EXPECT_LT(share(shots.depths[i] > 60.0f), 1e-9) << "a closed world";
      std::vector<cv::KeyPoint> corners;
      cv::FAST(shots.images[i], corners, 15);
      EXPECT_GT(corners.size(), 60u) << i;
    }
  }
}

TEST(RobotWorlds, ADeskIs30CentimetresToOneMetreAway) {
  for (const int seed : {1, 2})
    for (const cv::Mat1f& depth : shoot("desk", "d435_small", seed).depths) {
      EXPECT_GT(share((depth > 0.28f) & (depth < 1.1f)), 0.97) << "seed " << seed;
      // Disparities are 212.5 px * 0.05 m by the depth.
      EXPECT_GT(share(cv::Mat1f(212.5 * 0.05 / depth) > 9.6f), 0.97);
    }
}

TEST(RobotWorlds, ACorridorIsMostlyPlain) {
  // Share of pixels around which nothing rises above the noise of 1.5 grey levels.
  const auto plain = [](const cv::Mat1b& image) {
    cv::Mat1f smooth, mean, square;
    cv::GaussianBlur(cv::Mat1f(image), smooth, cv::Size(), 2.0);
    cv::blur(smooth, mean, cv::Size(9, 9));
    cv::blur(smooth.mul(smooth), square, cv::Size(9, 9));
    return share(square - mean.mul(mean) < 2.0f * 2.0f);
  };
  const cv::Mat1b corridor = shoot("corridor", "d435", 1).images[0], room = shoot("hand_held", "d435", 1).images[0];
  EXPECT_GT(plain(corridor), 0.5);
  EXPECT_LT(plain(room), 0.3);
}

TEST(RobotWorlds, BelongToTheirMotions) {
  const DrivePath walk = makePresetPath("hand_held", 400, 20.0, 1);
  EXPECT_THROW(makeWorld(Scenery::kCorridor, walk, 1), std::invalid_argument);
  EXPECT_THROW(makeWorld(Scenery::kDesk, walk, 1), std::invalid_argument);
  EXPECT_EQ(presetScenery("desk"), Scenery::kDesk);
  EXPECT_EQ(presetScenery("straight"), std::nullopt);
}

TEST(RobotWorlds, AFastTurnSmearsEdgesInsteadOfRepeatingThem) {
  // 5 rad/s to the right for 24 ms: 25 px at the middle of d435_small.
  constexpr double kRate = 5.0, kExposure = 0.024;
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 3; ++i) poses.emplace_back(Eigen::AngleAxisd(0.05 * kRate * i, Eigen::Vector3d::UnitY()));
  const DrivePath path(poses, 20.0);
  const auto shot = [&](double exposure) {
    RenderOptions options;
    options.effects.noise = options.effects.defocus = 0.0;
    options.effects.motion_blur = exposure;
    const DriveRenderer renderer(path, Scenery::kRoom, findRig("d435_small").camera, options, 0, 3, 1);
    DriveRenderer::Worker worker = renderer.makeWorker();
    // Near the optical axis, where a turn moves everything alike.
    return cv::Mat1b(renderer.render(1, worker).left(cv::Rect(162, 70, 100, 100)));
  };
  const cv::Mat1b sharp = shot(0.0), blurred = shot(kExposure);
  cv::Mat1f box, ghosts, kernel(1, 25, 0.0f);
  cv::Mat(sharp).convertTo(box, CV_32F);
  for (int i = 0; i < 25; i += 3) kernel(0, i) = 1.0f / 9.0f;
  cv::filter2D(box, ghosts, -1, kernel);
  cv::blur(box, box, cv::Size(25, 1));
  const cv::Rect inside(13, 0, 74, 100);
  const auto difference = [&](const cv::Mat1f& other) { return cv::norm(box(inside), other(inside), cv::NORM_L1); };
  EXPECT_LT(difference(cv::Mat1f(blurred)), difference(ghosts));
  EXPECT_LT(difference(cv::Mat1f(blurred)), 0.3 * difference(cv::Mat1f(sharp)));
}

}  // namespace sdvo::render::test_robot_drives
