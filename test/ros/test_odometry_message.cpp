#include <gtest/gtest.h>
#include <tf2/LinearMath/Quaternion.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "message_samples.hpp"

namespace sdvo::ros_conversions::test_odometry_message {

/// A camera that looks ahead, mounted 1.2 m ahead, 0.3 m left of and 1.6 m above the base.
Eigen::Isometry3d mountedCamera() {
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity();
  T_base_camera.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  T_base_camera.translation() << 1.2, 0.3, 1.6;
  return T_base_camera;
}

/// Constant turn of the base in its plane over dt: an arc of a circle.
Eigen::Isometry3d arc(double speed, double yaw_rate, double dt) {
  const double angle = yaw_rate * dt, radius = speed / yaw_rate;
  return Eigen::Translation3d(radius * std::sin(angle), radius * (1.0 - std::cos(angle)), 0.0) *
         Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ());
}

/// Of a position or a vector.
template <class Message>
void expectNear(const Message& message, const Eigen::Vector3d& expected, double tolerance) {
  EXPECT_LT((Eigen::Vector3d(message.x, message.y, message.z) - expected).cwiseAbs().maxCoeff(), tolerance) << message;
}

using Covariance = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>;

Matrix6d covarianceOf(const boost::array<double, 36>& message) {
  return Covariance(message.data());
}

void expectValidCovariance(const Matrix6d& covariance) {
  EXPECT_TRUE(covariance.allFinite());
  EXPECT_EQ(covariance, covariance.transpose());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance).eigenvalues().minCoeff(), 0.0);
}

double yawOf(const geometry_msgs::Quaternion& q) {
  return std::atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z));
}

TEST(ToOdometry, ForwardOfTheCameraIsXAndALeftTurnIsPositiveYaw) {
  OdometryResult result = trackedResult();
  const Eigen::Isometry3d optical(mountedCamera().linear());

  result.T_origin_camera = Eigen::Translation3d(0.0, 0.0, 2.5);  // optical z is forward
  geometry_msgs::Pose pose = toOdometry(result, optical, {}).pose.pose;
  expectNear(pose.position, {2.5, 0.0, 0.0}, 1e-12);
  EXPECT_NEAR(yawOf(pose.orientation), 0.0, 1e-12);

  result.T_origin_camera = Eigen::Translation3d(-1.0, -2.0, 0.0);  // optical x is right, y is down
  pose = toOdometry(result, optical, {}).pose.pose;
  EXPECT_NEAR(pose.position.y, 1.0, 1e-12);
  EXPECT_NEAR(pose.position.z, 2.0, 1e-12);

  // Turning left moves the view's right side towards the front: about optical y (down) that is negative.
  result.T_origin_camera = Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY());
  EXPECT_NEAR(yawOf(toOdometry(result, optical, {}).pose.pose.orientation), 0.3, 1e-12);
}

TEST(ToOdometry, GoesOnFromWhereTheBaseWasPut) {
  OdometryResult result = trackedResult();
  const Eigen::Isometry3d optical(mountedCamera().linear());
  result.T_origin_camera = Eigen::Translation3d(0.0, 0.0, 2.5);  // forward
  const Eigen::Isometry3d T_odom_start =
      Eigen::Translation3d(10.0, 5.0, 0.0) * Eigen::AngleAxisd(CV_PI / 2.0, Eigen::Vector3d::UnitZ());  // looks along y
  const geometry_msgs::Pose pose = toOdometry(result, optical, {}, T_odom_start).pose.pose;
  EXPECT_NEAR(pose.position.x, 10.0, 1e-12);
  EXPECT_NEAR(pose.position.y, 7.5, 1e-12);
  EXPECT_NEAR(yawOf(pose.orientation), CV_PI / 2.0, 1e-12);
}

TEST(ToPose, AnglesAreAboutTheFixedAxes) {
  const Eigen::Isometry3d pose = toPose(" 1 -2.5 3e-1  0.1 0.2\t0.3 ");
  EXPECT_EQ(pose.translation(), Eigen::Vector3d(1.0, -2.5, 0.3));
  tf2::Quaternion expected;
  expected.setRPY(0.1, 0.2, 0.3);
  const Eigen::Quaterniond found(pose.linear());
  EXPECT_NEAR(found.x(), expected.x(), 1e-12);
  EXPECT_NEAR(found.y(), expected.y(), 1e-12);
  EXPECT_NEAR(found.z(), expected.z(), 1e-12);
  EXPECT_NEAR(found.w(), expected.w(), 1e-12);
}

TEST(ToOdometry, PoseAndTwistAreThoseOfTheBaseNotOfTheCamera) {
  const Eigen::Isometry3d T_base_camera = mountedCamera();
  const double dt = 0.1, speed = 8.0, yaw_rate = 0.7;
  OdometryResult result = trackedResult();
  result.dt = dt;
  result.T_previous_current = T_base_camera.inverse() * arc(speed, yaw_rate, dt) * T_base_camera;
  result.T_origin_camera = T_base_camera.inverse() * arc(speed, yaw_rate, 2.0) * T_base_camera;
  const nav_msgs::Odometry odometry = toOdometry(result, T_base_camera, {"world", "robot"});

  EXPECT_EQ(odometry.header.frame_id, "world");
  EXPECT_EQ(odometry.child_frame_id, "robot");
  EXPECT_EQ(odometry.header.stamp.toNSec(), 1000000000100000007u);
  // After 2 s on the circle.
  expectNear(odometry.pose.pose.position,
             {speed / yaw_rate * std::sin(1.4), speed / yaw_rate * (1.0 - std::cos(1.4)), 0.0}, 1e-9);
  EXPECT_NEAR(yawOf(odometry.pose.pose.orientation), 1.4, 1e-9);
  // In the base's own frame the velocity of a constant turn is constant.
  const geometry_msgs::Twist& twist = odometry.twist.twist;
  expectNear(twist.linear, {speed, 0.0, 0.0}, 1e-9);
  expectNear(twist.angular, {0.0, 0.0, yaw_rate}, 1e-9);
}

TEST(ToOdometry, QuaternionIsUnitAlsoForADriftedRotation) {
  OdometryResult result = trackedResult();
  result.T_origin_camera = Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, -1.0).normalized());
  result.T_origin_camera.linear() *= 1.0 + 1e-5;
  const geometry_msgs::Quaternion q = toOdometry(result, mountedCamera(), {}).pose.pose.orientation;
  EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1.0, 1e-12);
}

TEST(ToOdometry, TheFirstPairHasNoTwistAndSaysSo) {
  OdometryResult result = trackedResult();
  result.has_motion = false;
  result.dt = 0.0;
  result.pose_covariance.setZero();
  const nav_msgs::Odometry odometry = toOdometry(result, mountedCamera(), {});
  EXPECT_EQ(odometry.twist.twist.linear.x, 0.0);
  EXPECT_EQ(odometry.twist.twist.angular.z, 0.0);
  const Matrix6d twist = covarianceOf(odometry.twist.covariance);
  expectValidCovariance(twist);
  EXPECT_GE(twist.diagonal().minCoeff(), 1e5);  // nothing that moves on the ground is that fast
  const Matrix6d pose = covarianceOf(odometry.pose.covariance);
  expectValidCovariance(pose);  // the initial pose is exact by definition, yet filters invert this matrix
  EXPECT_LT(pose.diagonal().maxCoeff(), 1e-6);
  result.dt = 0.1;  // seeded anew: the motion since the last pair is not known either
  result.motion_covariance.setZero();
  EXPECT_GE(covarianceOf(toOdometry(result, mountedCamera(), {}).twist.covariance).diagonal().minCoeff(), 1e5);
}

/// A covariance without any symmetry that would hide a mix-up of axes.
Matrix6d someCovariance() {
  Matrix6d root;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = uniform(random);
  Vector6d scale;
  scale << 2e-3, 1e-3, 4e-3, 1e-3, 5e-4, 2e-3;
  return scale.asDiagonal() * (root * root.transpose() + 0.1 * Matrix6d::Identity()) * scale.asDiagonal();
}

/// Sample covariance of what `measure` makes of small random camera perturbations of covariance `covariance`.
Matrix6d sampledCovariance(const Matrix6d& covariance,
                           const std::function<Vector6d(const Eigen::Isometry3d& perturbation)>& measure) {
  const Matrix6d root = covariance.llt().matrixL();
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0.0, 1.0);
  constexpr int kSamples = 100000;
  Matrix6d sum = Matrix6d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    Vector6d xi;
    for (int k = 0; k < 6; ++k) xi[k] = normal(random);
    xi = root * xi;
    // To first order, all that counts at a few milliradian.
    const Vector6d y =
        measure(Eigen::Translation3d(xi.head<3>()) * Eigen::AngleAxisd(xi.tail<3>().norm(), xi.tail<3>().normalized()));
    sum += y * y.transpose();
  }
  return sum / kSamples;
}

Eigen::Vector3d rotationVector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

/// Equal within the sampling error; correlations are compared in units of the standard deviations.
void expectSameCovariance(const Matrix6d& actual, const Matrix6d& expected) {
  const Vector6d sigma = expected.diagonal().cwiseSqrt();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(actual(i, j) / (sigma[i] * sigma[j]), expected(i, j) / (sigma[i] * sigma[j]), 0.03)
          << "element " << i << "," << j;
}

TEST(ToOdometry, PoseCovarianceIsThatOfThePublishedPose) {
  const Eigen::Isometry3d T_base_camera = mountedCamera();
  OdometryResult result = trackedResult();
  result.T_origin_camera =
      Eigen::Translation3d(3.0, -1.0, 20.0) * Eigen::AngleAxisd(-1.1, Eigen::Vector3d(0.2, 1.0, -0.1).normalized());
  result.pose_covariance = someCovariance();
  const Matrix6d covariance = covarianceOf(toOdometry(result, T_base_camera, {}).pose.covariance);
  expectValidCovariance(covariance);

  // ROS: position in the axes of odom, rotation about the fixed axes of odom.
  const Eigen::Isometry3d mean = T_base_camera * result.T_origin_camera * T_base_camera.inverse();
  expectSameCovariance(
      covariance, sampledCovariance(result.pose_covariance, [&](const Eigen::Isometry3d& xi) {
        const Eigen::Isometry3d sample = T_base_camera * result.T_origin_camera * xi * T_base_camera.inverse();
        Vector6d y;
        y << sample.translation() - mean.translation(), rotationVector(sample.linear() * mean.linear().transpose());
        return y;
      }));
}

TEST(ToOdometry, TwistCovarianceIsThatOfThePublishedTwist) {
  const Eigen::Isometry3d T_base_camera = mountedCamera();
  OdometryResult result = trackedResult();
  result.dt = 0.05;
  result.motion_covariance = someCovariance();
  const Matrix6d covariance = covarianceOf(toOdometry(result, T_base_camera, {}).twist.covariance);
  expectValidCovariance(covariance);
  // At rest the twist is the perturbation itself over dt, seen from the base.
  expectSameCovariance(covariance, sampledCovariance(result.motion_covariance, [&](const Eigen::Isometry3d& xi) {
                         const Eigen::Isometry3d sample = T_base_camera * xi * T_base_camera.inverse();
                         Vector6d y;
                         y << sample.translation() / result.dt, rotationVector(sample.linear()) / result.dt;
                         return y;
                       }));
}

TEST(ToOdometry, AMeanVelocityOverAGapSaysLittleOfThePresentOne) {
  OdometryResult result = trackedResult();
  result.motion_covariance = 1e-6 * Matrix6d::Identity();
  const auto deviation = [&](double dt, int axis) {
    result.dt = dt;
    return std::sqrt(covarianceOf(toOdometry(result, Eigen::Isometry3d::Identity(), {}).twist.covariance)(axis, axis));
  };
  EXPECT_NEAR(deviation(0.1, 0), 0.01, 1e-4);
  EXPECT_NEAR(deviation(0.2, 0), 0.005, 1e-4);
  EXPECT_NEAR(deviation(1.5, 0), 0.5 * 5.0 * 1.3, 1e-3);
  EXPECT_NEAR(deviation(1.5, 5), 0.5 * 2.0 * 1.3, 1e-3);
}

TEST(CleanFrameId, LosesTheLeadingSlash) {
  EXPECT_EQ(cleanFrameId("/odom"), "odom");
  EXPECT_EQ(cleanFrameId("robot/odom"), "robot/odom");
  EXPECT_EQ(cleanFrameId(""), "");
}

Eigen::Isometry3d poseOf(const geometry_msgs::TransformStamped& message) {
  const auto& t = message.transform.translation;
  const auto& q = message.transform.rotation;
  return Eigen::Translation3d(t.x, t.y, t.z) * Eigen::Quaterniond(q.w, q.x, q.y, q.z);
}

TEST(ToTransform, EqualsTheOdometryOrItsInverse) {
  OdometryResult result = trackedResult();
  result.T_origin_camera = Eigen::Translation3d(3.0, -1.0, 20.0) * Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitY());
  const nav_msgs::Odometry odometry = toOdometry(result, mountedCamera(), {"world", "robot"});
  const geometry_msgs::TransformStamped direct = toTransform(odometry, false);
  EXPECT_EQ(direct.header.frame_id, "world");
  EXPECT_EQ(direct.child_frame_id, "robot");
  EXPECT_EQ(direct.header.stamp, odometry.header.stamp);
  EXPECT_NEAR(direct.transform.translation.x, odometry.pose.pose.position.x, 1e-12);
  EXPECT_NEAR(direct.transform.translation.y, odometry.pose.pose.position.y, 1e-12);
  EXPECT_NEAR(direct.transform.rotation.z, odometry.pose.pose.orientation.z, 1e-12);
  EXPECT_NEAR(direct.transform.rotation.w, odometry.pose.pose.orientation.w, 1e-12);

  const geometry_msgs::TransformStamped inverse = toTransform(odometry, true);
  EXPECT_EQ(inverse.header.frame_id, "robot");
  EXPECT_EQ(inverse.child_frame_id, "world");
  EXPECT_EQ(inverse.header.stamp, odometry.header.stamp);
  EXPECT_TRUE((poseOf(direct) * poseOf(inverse)).isApprox(Eigen::Isometry3d::Identity(), 1e-12));
}

}  // namespace sdvo::ros_conversions::test_odometry_message
