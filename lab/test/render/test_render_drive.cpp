#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdlib>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "../../render/drive_renderer.hpp"
#include "../../render/preset_paths.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo::render::test_render_drive {

StereoCamera smallCamera() {
  return {176.77, 176.77, 150.0, 45.0, 0.5371, 310, 94};
}

RenderOptions plainOptions() {
  RenderOptions options;
  options.effects.noise = 0.0;
  options.effects.defocus = 0.0;
  options.moving_share = 0.0;
  return options;
}

DriveRenderer street(const DrivePath& path, const RenderOptions& options, int threads = 1) {
  return {path, DriveRenderer::Scenery::kStreet, smallCamera(), options, 0, path.count(), threads};
}

StereoPair renderOne(const DriveRenderer& renderer, int frame) {
  DriveRenderer::Worker worker = renderer.makeWorker();
  return renderer.render(frame, worker);
}

/// Of the street, by these options.
StereoPair renderOne(const DrivePath& path, const RenderOptions& options, int frame) {
  return renderOne(street(path, options), frame);
}

double meanDifference(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat difference;
  cv::absdiff(a, b, difference);
  return cv::mean(difference)[0];
}

TEST(RenderDrive, TheRightCameraCanBeLate) {
  const DrivePath path = makePresetPath("straight", 4, 10.0, 1);
  RenderOptions options = plainOptions();
  const StereoPair before = renderOne(path, options, 1), after = renderOne(path, options, 2);
  options.shutters.right_delay = 0.1;
  const StereoPair late = renderOne(path, options, 1);
  EXPECT_EQ(0.0, cv::norm(late.left, before.left, cv::NORM_INF));
  EXPECT_EQ(0.0, cv::norm(late.right, after.right, cv::NORM_INF));
}

TEST(RenderDrive, AMountShiftsAndTurnsTheCameraInTheSameWorld) {
  const DrivePath path = makePresetPath("straight", 4, 10.0, 1);
  RenderOptions options = plainOptions();
  const StereoPair ahead = renderOne(path, options, 0);
  options.mount.x = smallCamera().baseline;
  const StereoPair shifted = renderOne(path, options, 0);
  EXPECT_LT(meanDifference(shifted.left, ahead.right), 0.01);
  options.mount.yaw = 180.0;
  EXPECT_GT(meanDifference(renderOne(path, options, 0).left, ahead.left), 5.0);
}

TEST(RenderDrive, ARollingShutterTakesTheFirstRowsEarlierAndTheLastOnesLater) {
  const DrivePath path = makePresetPath("straight", 4, 10.0, 1);
  RenderOptions options = plainOptions();
  const StereoPair now = renderOne(path, options, 1), after = renderOne(path, options, 2);
  options.shutters.readout = 0.1;
  const StereoPair rolling = renderOne(path, options, 1);
  const cv::Range middle(45, 49), last(86, 94);  // of 94 rows; half of the readout later are the last ones
  EXPECT_LT(meanDifference(rolling.left.rowRange(middle), now.left.rowRange(middle)),
            0.5 * meanDifference(after.left.rowRange(middle), now.left.rowRange(middle)));
  EXPECT_GT(meanDifference(rolling.left.rowRange(last), now.left.rowRange(last)), 1.0);
  options.shutters.readout = 0.0;
  options.shutters.right_delay = 0.05;
  const StereoPair half = renderOne(path, options, 1);
  EXPECT_LT(meanDifference(rolling.right.rowRange(last), half.right.rowRange(last)),
            0.5 * meanDifference(rolling.right.rowRange(last), now.right.rowRange(last)));
}

TEST(RenderDrive, IsTheSameForAnyNumberOfThreadsAndDiffersByTheSeed) {
  const DrivePath path = makePresetPath("straight", 10, 10.0, 1);
  RenderOptions options;
  options.moving_share = 0.02;
  const DriveRenderer one = street(path, options), three = street(path, options, 3);
  // Another order of frames as well: nothing may be carried over.
  const StereoPair last_of_three = renderOne(three, 9), first_of_three = renderOne(three, 0);
  const StereoPair first_of_one = renderOne(one, 0), last_of_one = renderOne(one, 9);
  EXPECT_EQ(0.0, cv::norm(first_of_one.left, first_of_three.left, cv::NORM_INF));
  EXPECT_EQ(0.0, cv::norm(first_of_one.right, first_of_three.right, cv::NORM_INF));
  EXPECT_EQ(0.0, cv::norm(last_of_one.left, last_of_three.left, cv::NORM_INF));
  options.seed = 2;
  EXPECT_GT(meanDifference(renderOne(path, options, 0).left, first_of_one.left), 5.0);
}

TEST(RenderDrive, FlowAndDisparityOfTheTruthExplainTheImages) {
  const DrivePath path = makePresetPath("straight", 6, 10.0, 1);
  RenderOptions options = plainOptions();
  options.moving_share = 0.05;
  const DriveRenderer renderer = street(path, options);
  DriveRenderer::Worker worker = renderer.makeWorker();
  const StereoPair now = renderer.render(3, worker), next = renderer.render(4, worker);
  const Truth truth = renderer.truth(3, worker);

  cv::Mat1f to_right_x(truth.depth.size(), -1.0f), to_next_x = to_right_x.clone(), y = to_right_x.clone(),
                                                   next_y = y.clone();
  cv::Mat1b moving_seen(truth.depth.size(), std::uint8_t{0}), still_seen = moving_seen.clone();
  for (int row = 0; row < y.rows; ++row)
    for (int col = 0; col < y.cols; ++col) {
      if (!std::isfinite(truth.depth(row, col))) continue;
      EXPECT_NEAR(truth.disparity(row, col) * truth.depth(row, col), 176.77 * 0.5371, 1e-3 * 176.77);
      to_right_x(row, col) = col - truth.disparity(row, col);
      y(row, col) = row;
      to_next_x(row, col) = col + truth.flow(row, col)[0];
      next_y(row, col) = row + truth.flow(row, col)[1];
      const bool inside = to_next_x(row, col) > 1 && to_next_x(row, col) < y.cols - 2 && next_y(row, col) > 1 &&
                          next_y(row, col) < y.rows - 2;
      if (inside) (truth.moving(row, col) ? moving_seen : still_seen)(row, col) = 1;
    }
  cv::Mat from_right, from_next;
  cv::remap(now.right, from_right, to_right_x, y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::remap(next.left, from_next, to_next_x, next_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  const auto medianDifference = [&](const cv::Mat& other, const cv::Mat1b& mask) {
    std::vector<int> values;
    for (int row = 0; row < mask.rows; ++row)
      for (int col = 0; col < mask.cols; ++col)
        if (mask(row, col)) values.push_back(std::abs(int(now.left(row, col)) - int(other.at<std::uint8_t>(row, col))));
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
  };
  ASSERT_GT(cv::countNonZero(still_seen), 10000);
  ASSERT_GT(cv::countNonZero(moving_seen), 100);
  EXPECT_LE(medianDifference(from_right, still_seen), 2);
  EXPECT_LE(medianDifference(from_next, still_seen), 3);
  EXPECT_LE(medianDifference(from_next, moving_seen), 6);
  EXPECT_GT(medianDifference(next.left, still_seen), 2 * medianDifference(from_next, still_seen)) << "without flow";
}

TEST(RenderDrive, TheRoadIsFreeOnEveryPartOfAWayThatCrossesItself) {
  // The depth at the image's lower middle is that of flat ground 1.65 m below, 1.65 f / (v - cy), all the way; at the
  // crossing the road lies up to 0.2 m lower because two slopes meet.
  const DrivePath path = makePresetPath("figure_eight", 0, 10.0, 1);
  const DriveRenderer renderer = street(path, plainOptions());
  DriveRenderer::Worker worker = renderer.makeWorker();
  int checked_frames = 0;
  for (int frame = 0; frame < path.count(); frame += 6, ++checked_frames) {
    const Truth truth = renderer.truth(frame, worker);
    const int row = 92, col = 150;
    EXPECT_NEAR(truth.depth(row, col), 1.65 * 176.77 / (row - 45.0), 0.9) << "frame " << frame;
    for (int c = 120; c < 180; ++c) EXPECT_GT(truth.depth(60, c), 6.0) << "frame " << frame << ", column " << c;
  }
  EXPECT_GT(checked_frames, 70);
}

TEST(RenderDrive, TheGroundFollowsARealWayThatRepeatsItself) {
  const char* kitti = std::getenv("KITTI_DIR");
  if (!kitti) GTEST_SKIP() << "KITTI_DIR is not set: the real trajectory is not tested";
  const DrivePath path(readKittiPoses(std::string(kitti) + "/poses/05.txt"), 10.0);
  const RoadLine road(path, 1.65);
  const GroundMap ground(road);
  double worst_above = 0.0, least_above = 1e9;
  for (const Eigen::Isometry3d& pose : path.poses()) {
    const Eigen::Vector3d at = pose.translation();
    const double above = ground.height(at.x(), at.z()) - at.y();
    worst_above = std::max(worst_above, above);
    least_above = std::min(least_above, above);
  }
  EXPECT_GT(least_above, 1.3) << "the camera must stay above the ground";
  EXPECT_LT(worst_above, 1.65 + 0.9) << "05 comes by again up to 0.7 m higher";
}

TEST(RenderDrive, MovingShareIsMetAndZeroMeansNone) {
  const DrivePath path = makePresetPath("straight", 60, 10.0, 1);
  RenderOptions options = plainOptions();
  options.moving_share = 0.04;
  const DriveRenderer busy = street(path, options);
  DriveRenderer::Worker worker = busy.makeWorker();
  double share = 0.0;
  for (int frame = 0; frame < 60; frame += 3) share += cv::mean(busy.truth(frame, worker).moving)[0] / 20.0;
  EXPECT_NEAR(share, 0.04, 0.012);
  EXPECT_NEAR(busy.movingShare(), 0.04, 0.008);
  const DriveRenderer empty = street(path, plainOptions());
  DriveRenderer::Worker idle = empty.makeWorker();
  EXPECT_EQ(0, cv::countNonZero(empty.truth(10, idle).moving));
}

TEST(RenderDrive, CarsBeyondTheEndOfTheRoadAreNotThere) {
  // A way of 399 m whose road ends 160 m after its second pose: the car in front has no ground under it in the end.
  const DrivePath path = makePresetPath("straight", 400, 10.0, 1);
  const DrivePath beginning({path.pose(0), path.pose(1)}, 10.0);
  const RoadLine road(beginning, 1.65);
  const GroundMap ground(road);
  const Traffic traffic(path, road, ground, 4.0, 1);
  const double road_end = road.samples().back().distance;
  ASSERT_LT(road_end, 200.0);
  EXPECT_FALSE(traffic.at(1.0).empty());
  int seen = 0;
  for (double time = 0.0; time < 39.0; time += 0.25)
    for (const Traffic::Car& car : traffic.at(time)) {
      ++seen;
      // A pose that is no rotation makes rays that are not numbers.
      EXPECT_NEAR(car.T_world_car.linear().determinant(), 1.0, 1e-9) << "car " << car.id << " at " << time << " s";
      EXPECT_LT(car.T_world_car.translation().z(), road_end - 1.0) << "car " << car.id << " at " << time << " s";
    }
  EXPECT_GT(seen, 100);
}

TEST(RenderDrive, MisalignmentMovesTheRightImageOnly) {
  const DrivePath path = makePresetPath("still", 1, 10.0, 1);
  RenderOptions options = plainOptions();
  const StereoPair right_way = renderOne(path, options, 0);
  options.misalignment.disparity_offset = 2.0;
  const StereoPair offset = renderOne(path, options, 0);
  EXPECT_EQ(0.0, cv::norm(right_way.left, offset.left, cv::NORM_INF));
  // A larger disparity: what was at u is now at u - 2.
  const cv::Rect window(6, 0, 294, 94), shifted(4, 0, 294, 94);
  EXPECT_LT(meanDifference(right_way.right(window), offset.right(shifted)),
            0.4 * meanDifference(right_way.right(window), offset.right(window)));
}

TEST(RenderDrive, ATurnedRightCameraSeesWhatItsHomographySays) {
  const DrivePath path = makePresetPath("still", 1, 10.0, 1);
  RenderOptions options = plainOptions();
  const cv::Mat straight = renderOne(path, options, 0).right;
  Misalignment& wrong = options.misalignment;
  wrong.rotation_x = 0.5, wrong.rotation_y = -1.0, wrong.rotation_z = 1.5;
  const cv::Mat turned = renderOne(path, options, 0).right;

  // Turned by R, it sees at u what it saw at K R K^-1 u.
  const auto turn = [](double degrees, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(degrees * M_PI / 180.0, axis);
  };
  const Eigen::Matrix3d R(turn(wrong.rotation_z, Eigen::Vector3d::UnitZ()) *
                          turn(wrong.rotation_y, Eigen::Vector3d::UnitY()) *
                          turn(wrong.rotation_x, Eigen::Vector3d::UnitX()));
  const StereoCamera camera = smallCamera();
  Eigen::Matrix3d K;
  K << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  cv::Mat homography, expected;
  cv::eigen2cv(Eigen::Matrix3d(K * R * K.inverse()), homography);
  cv::warpPerspective(straight, expected, homography, straight.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  const cv::Rect window(20, 15, 270, 64);
  EXPECT_LT(meanDifference(turned(window), expected(window)), 0.3 * meanDifference(turned(window), straight(window)));
}

TEST(RenderDrive, StandingStillGivesOneImageAgainAndAgain) {
  const DrivePath path = makePresetPath("still", 5, 10.0, 1);
  const DriveRenderer renderer = street(path, plainOptions());
  EXPECT_EQ(0.0, cv::norm(renderOne(renderer, 0).left, renderOne(renderer, 4).left, cv::NORM_INF));
}

TEST(RenderDrive, DroppedFramesAreTheShareAskedForAndNeverTheFirst) {
  const DrivePath path = makePresetPath("still", 3000, 10.0, 1);
  RenderOptions options = plainOptions();
  options.dropped_frames = 0.2;
  const DriveRenderer renderer = street(path, options);
  int dropped = 0;
  for (int frame = 0; frame < 3000; ++frame) dropped += renderer.isDropped(frame);
  EXPECT_FALSE(renderer.isDropped(0));
  EXPECT_NEAR(dropped / 3000.0, 0.2, 0.03);  // four standard deviations
}

TEST(RenderEffects, NoiseVignettingExposureAndBlurHaveTheirStrength) {
  const cv::Mat1f grey(200, 300, 0.4f);
  CameraEffects effects;
  effects.defocus = 0.0;
  effects.noise = 3.0;
  cv::Scalar mean, deviation;
  cv::meanStdDev(effects.apply(grey, 0.0, 1, 0), mean, deviation);
  EXPECT_NEAR(mean[0], 102.0, 0.1);
  EXPECT_NEAR(deviation[0], std::sqrt(9.0 + 1.0 / 12.0), 0.05);
  effects.noise = 0.0;
  effects.vignetting = 0.5;
  const cv::Mat1b dark = effects.apply(grey, 0.0, 1, 0);
  EXPECT_NEAR(dark(0, 0), 51, 1);
  EXPECT_NEAR(dark(100, 150), 102, 1);
  effects.vignetting = 0.0;
  effects.exposure = 0.3;
  double low = 9.0, high = 0.0, sum = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double gain = effects.gain(i * 0.1, 1);
    low = std::min(low, gain);
    high = std::max(high, gain);
    sum += gain;
  }
  EXPECT_NEAR(low, 0.7, 0.02);
  EXPECT_NEAR(high, 1.3, 0.02);
  EXPECT_NEAR(sum / 20000, 1.0, 0.01);
  effects.exposure = 0.0;
  effects.defocus = 2.0;
  cv::Mat1f point(41, 41, 0.0f);
  point(20, 20) = 12.0f;
  // A point spread by a Gaussian of 2 px has its height divided by 2 pi 2².
  EXPECT_NEAR(effects.apply(point, 0.0, 1, 0)(20, 20), 255.0 * 12.0 / (2.0 * M_PI * 4.0), 4.0);
}

TEST(RenderDrive, MotionBlurSmearsAlongTheMotionAndKeepsTheMiddle) {
  // Turning right by 0.1 rad per frame of 0.1 s with 20 ms exposure: 0.02 rad, 3.5 px sideways, none up or down.
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 3; ++i) poses.emplace_back(Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitY()));
  const DrivePath path(poses, 10.0);
  RenderOptions options = plainOptions();
  const cv::Mat1b sharp = renderOne(path, options, 1).left;
  options.effects.motion_blur = 0.02;
  const cv::Mat1b blurred = renderOne(path, options, 1).left;
  cv::Mat1b expected, wrong;
  cv::blur(sharp, expected, cv::Size(3, 1));
  cv::blur(sharp, wrong, cv::Size(1, 3));
  EXPECT_LT(meanDifference(blurred, expected), 0.75 * meanDifference(blurred, sharp));
  EXPECT_LT(meanDifference(blurred, expected), 0.75 * meanDifference(blurred, wrong));
}

TEST(RenderDrive, PresetsHaveTheirShape) {
  const auto length = [](const DrivePath& path) { return path.distanceAt((path.count() - 1) / path.rate()); };
  const DrivePath loop = makePresetPath("city_loop", 0, 10.0, 1);
  EXPECT_GT(length(loop), 1000.0);
  const Eigen::Vector3d gap = loop.pose(loop.count() - 1).translation();
  EXPECT_LT(gap.norm(), 3.0) << "a loop comes back";
  const DrivePath eight = makePresetPath("figure_eight", 0, 10.0, 1);
  EXPECT_NEAR(eight.count(), 10.0 * 2.0 * 2.0 * M_PI * 28.0 / 7.0, 1.0) << "two circles of 28 m radius at 7 m/s";
  int standing = 0;
  for (int i = 1; i < loop.count(); ++i)
    standing += (loop.pose(i).translation() - loop.pose(i - 1).translation()).norm() < 1e-9;
  EXPECT_GT(standing, 2 * 20) << "stops of three seconds";
  const DrivePath to_and_fro = makePresetPath("back_and_forth", 0, 10.0, 1);
  ASSERT_EQ(to_and_fro.count(), 651);
  EXPECT_NEAR(length(to_and_fro), 200.0, 1.0);
  for (int lap = 0; lap <= 5; ++lap) EXPECT_LT(to_and_fro.pose(130 * lap).translation().norm(), 1e-9) << lap;
  EXPECT_NEAR(to_and_fro.pose(65).translation().z(), 20.0, 1e-9);
  const DrivePath hover = makePresetPath("hover", 2400, 20.0, 1), small = makePresetPath("hover_1m", 2400, 20.0, 1);
  Eigen::AlignedBox3d wide, cube;
  for (int i = 0; i < small.count(); ++i) {
    wide.extend(hover.pose(i).translation()), cube.extend(small.pose(i).translation());
    EXPECT_EQ(small.pose(i).linear(), hover.pose(i).linear());
  }
  EXPECT_GT(wide.sizes().minCoeff(), 1.1);
  EXPECT_LT((cube.sizes() - Eigen::Vector3d::Ones()).norm(), 1e-9);
  for (const std::string& name : presetNames()) {
    const DrivePath path = makePresetPath(name, 50, 10.0, 3);
    EXPECT_EQ(50, path.count());
    EXPECT_LT((path.pose(0).matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12) << name;
    for (int i = 1; i < 50; ++i)
      EXPECT_LT((path.pose(i).translation() - path.pose(i - 1).translation()).norm(), 1.3) << name;
  }
  EXPECT_THROW(makePresetPath("nowhere", 10, 10.0, 1), std::invalid_argument);
}

}  // namespace sdvo::render::test_render_drive
