// What the whole odometry promises, on rendered drives whose motion is exactly known.
#include <gtest/gtest.h>

#include <numeric>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "../../render/drive_renderer.hpp"
#include "../../render/preset_paths.hpp"
#include "../../render/rigs.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo::test_rendered_odometry {

constexpr double kRate = 10.0;  // Hz
constexpr int kThreads = 2;

std::int64_t stampOf(int frame) {
  return static_cast<std::int64_t>((frame + 1) * 1e9 / kRate);
}

struct Drive {
  render::DrivePath path;
  std::vector<render::StereoPair> pairs;
};

Drive renderDrive(int frames, const render::RenderOptions& options) {
  Drive drive{render::makePresetPath("figure_eight", frames, kRate, options.seed), {}};
  const render::DriveRenderer renderer(drive.path, render::DriveRenderer::Scenery::kStreet, render::kittiCamera(),
                                       options, 0, frames, kThreads);
  drive.pairs.resize(frames);
  cv::parallel_for_(cv::Range(0, frames), [&](const cv::Range& range) {
    render::DriveRenderer::Worker worker = renderer.makeWorker();
    for (int frame = range.start; frame < range.end; ++frame) drive.pairs[frame] = renderer.render(frame, worker);
  });
  return drive;
}

std::vector<StereoFeatures> extractAll(const Drive& drive) {
  const FeatureExtractor extractor{FeatureExtractorOptions{}};
  std::vector<StereoFeatures> features;
  for (std::size_t k = 0; k < drive.pairs.size(); ++k)
    features.push_back(extractor.extract(render::kittiCamera(), drive.pairs[k].left, drive.pairs[k].right,
                                         stampOf(static_cast<int>(k))));
  return features;
}

TEST(RenderedOdometry, MotionsAndPosesLieInTheirCovariancesAndTheRigIsCalibrated) {
  constexpr int kFrames = 40, kSettled = 20;
  std::vector<double> motions, poses,
      motions_of_off;  // squares in standard deviations: of aligned rigs, of one that is off
  for (const auto& [seed, disparity_offset] : {std::pair(1, 0.0), std::pair(2, 0.3), std::pair(3, 0.3)}) {
    render::RenderOptions options;
    options.seed = seed;
    options.misalignment.disparity_offset = disparity_offset;
    const Drive drive = renderDrive(kFrames, options);
    VisualOdometry odometry{VisualOdometryOptions{}};
    OdometryResult result;
    int frame = 0;
    double offsets = 0.0, sigmas = 0.0;
    for (const StereoFeatures& features : extractAll(drive)) {
      result = odometry.update(features);
      ASSERT_EQ(result.state, TrackingState::kTracking) << "seed " << seed << ": " << result.reason;
      if (result.has_motion) {
        const Eigen::Isometry3d truth = drive.path.pose(frame - 1).inverse() * drive.path.pose(frame);
        const Vector6d error = logSE3(result.T_previous_current.inverse() * truth);
        const double normalised = mahalanobisSquare(error, result.motion_covariance);
        (disparity_offset == 0.0 ? motions : motions_of_off).push_back(normalised);
        const Eigen::Isometry3d true_pose = drive.path.pose(0).inverse() * drive.path.pose(frame);
        const Vector6d pose_error = logSE3(result.T_origin_camera.inverse() * true_pose);
        if (disparity_offset == 0.0) poses.push_back(mahalanobisSquare(pose_error, result.pose_covariance));
      }
      if (frame >= kSettled) offsets += result.disparity_offset, sigmas += result.disparity_offset_sigma;
      ++frame;
    }
    EXPECT_NEAR(offsets / (kFrames - kSettled), disparity_offset, sigmas / (kFrames - kSettled)) << "seed " << seed;
    EXPECT_GE(offsets / (kFrames - kSettled), 0.5 * disparity_offset) << "seed " << seed;
  }
  const auto mean = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  };
  // Chi-square of six numbers has the mean 6. Bounds as of lab/run covariance; the poses of one drive err together.
  EXPECT_GE(mean(motions), 4.0);
  EXPECT_LE(mean(motions), 9.0);
  EXPECT_LE(mean(poses), 12.0);
  // A rig that is off by 0.3 px makes all distances wrong by the same ratio, which no covariance of a window contains.
  EXPECT_LE(mean(motions_of_off), 25.0);
}

}  // namespace sdvo::test_rendered_odometry
