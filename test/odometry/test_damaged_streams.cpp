#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo {
namespace test_damaged_streams {

constexpr int kPairs = 50;

/// A walk through a world, with damages that begin at random and last for some pairs.
class Stream {
 public:
  explicit Stream(unsigned seed)
      : random_(seed), world_(synthetic::randomWorld(seed, 900, {-15, -3, -5}, {15, 3, 40})) {
    elsewhere_ = synthetic::randomWorld(seed + 1, 300, {-9, -4, 3}, {9, 3, 25});
  }

  StereoFeatures next() {
    if (left_ == 0 && random_() % 5 == 0) {
      damage_ = static_cast<Damage>(random_() % kDamages);
      left_ = 1 + static_cast<int>(random_() % 8);
      if (damage_ == kStampsStep) stamp_ += static_cast<std::int64_t>(1e9 * std::pow(10.0, uniform(-2.0, 9.2)));
    }
    const Damage damage = left_ > 0 ? damage_ : kNone;
    if (left_ > 0) --left_;
    stamp_ += damage == kBurst ? 1000 : 100000000;
    Vector6d step;
    step << uniform(-0.1, 0.1), 0.0, 0.1 * speed_, 0.0, 0.1 * uniform(-0.5, 0.5), 0.0;
    if (damage == kStands) step.setZero();
    if (damage == kBrakes) speed_ *= 0.3;
    T_world_camera_ = T_world_camera_ * expSE3(step);
    return damaged(damage);
  }

  /// Of the last pair; none at times, and at times a wrong one.
  std::optional<MotionGuess> guess() {
    if (random_() % 3 != 0) return std::nullopt;
    MotionGuess guess;
    guess.T_previous_current.translation().z() = 0.1 * speed_ * uniform(0.5, 1.5);
    return guess;
  }

 private:
  enum Damage {
    kNone,
    kBlind,
    kElsewhere,
    kRefused,
    kYaw,
    kPitch,
    kWrongDisparities,
    kStands,
    kBrakes,
    kBurst,
    kStampsStep,
    kDamages
  };

  StereoFeatures damaged(Damage damage) {
    synthetic::Sighting sighting;
    sighting.noise = 0.3;
    sighting.strangers = 20;
    sighting.seed = random_();
    const StereoCamera rig = synthetic::camera();
    if (damage == kBlind) return synthetic::noFeatures(rig, stamp_);
    StereoFeatures features = synthetic::observe(damage == kElsewhere ? elsewhere_ : world_, rig,
                                                 T_world_camera_.inverse(), stamp_, sighting);
    features.report.refused = damage == kRefused;
    for (int i = 0; i < features.count(); ++i) {
      if (damage == kYaw) features.disparity[i] += 1.0F;
      if (damage == kPitch) features.dv[i] += 1.5F;
      if (damage == kWrongDisparities) features.disparity[i] *= static_cast<float>(uniform(0.5, 2.0));
    }
    return features;
  }

  double uniform(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }

  std::mt19937 random_;
  synthetic::World world_, elsewhere_;
  Eigen::Isometry3d T_world_camera_ = Eigen::Isometry3d::Identity();
  double speed_ = 1.0;  // m/s
  std::int64_t stamp_ = 1000000000;
  Damage damage_ = kNone;
  int left_ = 0;  // pairs that it lasts
};

/// In units of its diagonal, so that metres and radians compare.
double leastEigenvalue(const Matrix6d& covariance) {
  const Vector6d unit = covariance.diagonal().cwiseSqrt().cwiseInverse();
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(unit.asDiagonal() * covariance * unit.asDiagonal()).eigenvalues()[0];
}

double positionSigma(const Matrix6d& covariance) {
  return std::sqrt(covariance.topLeftCorner<3, 3>().trace());
}

TEST(DamagedStreams, EveryCovarianceIsPositiveDefiniteAndATrackedMotionIsKnown) {
  constexpr unsigned kStreams = 25;
  for (unsigned seed = 0; seed < kStreams && !HasFailure(); ++seed) {
    Stream stream(10 * seed);
    VisualOdometry odometry{VisualOdometryOptions()};
    double before = 0.0;  // m, of the pose
    for (int i = 0; i < kPairs; ++i) {
      const StereoFeatures features = stream.next();
      const OdometryResult result = odometry.update(features, stream.guess());
      SCOPED_TRACE("seed " + std::to_string(seed) + ", pair " + std::to_string(i) + ": " + result.reason);
      if (result.has_motion) {
        EXPECT_GT(leastEigenvalue(result.motion_covariance), 0.0);
        // A motion from a pose that was hardly known, as after a restart, contains what that lacked.
        if (result.state == TrackingState::kTracking) {
          EXPECT_LT(positionSigma(result.motion_covariance), 100.0 + before);
        }
      }
      if (!result.has_pose || result.reason == "first pair") continue;  // which is the origin
      EXPECT_TRUE(result.T_origin_camera.matrix().allFinite());
      EXPECT_GT(leastEigenvalue(result.pose_covariance), 0.0);
      before = positionSigma(result.pose_covariance);
    }
  }
}

}  // namespace test_damaged_streams
}  // namespace sdvo
