#!/usr/bin/env python3
"""The recipes for robot_localization in docs/fusing.md, tried on the launched pipeline: a filter of this file takes their YAML
as that package's EKF does, for Debian has none."""

import os
import re
import subprocess
import sys

import numpy as np
import roslib.packages
import rospy
import rostest
import tf2_ros
import yaml
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from kitti_replay import EPOCH, PACKAGE, ended_by, links, matrix_of
from made_up_sequence import STEP, MadeUpSequence
from pipeline_case import PipelineCase, camera_transform
from stereo_descriptor_vo.srv import SetPose

PAIRS, PERIOD = 30, 0.1  # s
FRAME = 'side_optical'  # of a camera that looks to the left, so that its way to the right is the robot's ahead
NOISE = np.array([.05, .05, .06, .03, .03, .06, .025, .025, .04, .01, .01, .02])  # the EKF's defaults, each second
LEAST = 1e-9  # variance


def recipes():
    with open(os.path.join(roslib.packages.get_pkg_dir(PACKAGE), 'docs', 'fusing.md')) as page:
        texts = re.findall(r'```yaml\n(.*?)```', page.read(), re.DOTALL)
    return [yaml.safe_load(text) for text in texts if 'odom0_config' in text]


def vector_of(T):
    R = T[:3, :3]
    return np.concatenate((T[:3, 3], [np.arctan2(R[2, 1], R[2, 2]), np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])),
                                      np.arctan2(R[1, 0], R[0, 0])]))


def transform_of(vector):
    (sr, sp, sy), (cr, cp, cy) = np.sin(vector[3:6]), np.cos(vector[3:6])
    T = np.eye(4)
    T[:3, :3] = [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                 [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]]
    T[:3, 3] = vector[:3]
    return T


def noise_of_twists():
    with open(os.path.join(roslib.packages.get_pkg_dir(PACKAGE), 'config', 'robot_localization.yaml')) as noise:
        return np.reshape(yaml.safe_load(noise)['process_noise_covariance'], (15, 15)).diagonal()[:12]


class Filter:
    """x y z, roll pitch yaw in the world; their rates in the base. No accelerations."""

    def __init__(self, recipe, noise=NOISE):
        self.recipe, self.noise = recipe, noise
        self.state, self.covariance, self.stamp = np.zeros(12), np.eye(12) * LEAST, None
        self.first, self.last, self.has_begun = {}, {}, False
        self.accepted, self.rejected = {}, {}

    def step(self, state, dt):
        following = state.copy()
        motion = np.concatenate((state[6:9], state[9:12])) * dt
        following[:6] = vector_of(transform_of(state) @ transform_of(motion))
        return following

    def predict(self, stamp):
        dt = 0.0 if self.stamp is None else (stamp - self.stamp).to_sec()
        if dt > 0.0:
            F = np.array([(self.step(self.state + e, dt) - self.step(self.state - e, dt)) / 2e-6 for e in np.eye(12) * 1e-6]).T
            self.state = self.step(self.state, dt)
            self.covariance = F @ self.covariance @ F.T + np.diag(self.noise) * dt
        self.stamp = stamp if self.stamp is None or dt > 0.0 else self.stamp

    def correct(self, name, kind, first, values, covariance):
        """Of six states from `first` on."""
        used = [i for i in range(6) if self.recipe[name + '_config'][first + i]]
        if not used:
            return
        threshold = self.recipe.get('%s_%s_rejection_threshold' % (name, kind), np.inf)
        H = np.eye(12)[[first + i for i in used]]
        R = np.array(covariance).reshape(6, 6)[np.ix_(used, used)]
        R[np.diag_indices_from(R)] = np.maximum(np.abs(R.diagonal()), LEAST)
        if not self.has_begun:  # the first measurement is the beginning
            self.has_begun = True
            self.state = H.T @ np.asarray(values)[used]
            self.covariance = H.T @ R @ H + np.diag(LEAST * (1 - H.sum(axis=0)))
            return
        innovation = np.asarray(values)[used] - H @ self.state
        for k, i in enumerate(used):
            if first + i in (3, 4, 5):
                innovation[k] = (innovation[k] + np.pi) % (2 * np.pi) - np.pi
        S = H @ self.covariance @ H.T + R
        is_outlier = np.sqrt(innovation @ np.linalg.solve(S, innovation)) > threshold
        counts = self.rejected if is_outlier else self.accepted
        counts[name] = counts.get(name, 0) + 1
        if is_outlier:
            return
        K = self.covariance @ H.T @ np.linalg.inv(S)
        self.state = self.state + K @ innovation
        I_KH = np.eye(12) - K @ H
        self.covariance = I_KH @ self.covariance @ I_KH.T + K @ R @ K.T

    def take_pose(self, name, stamp, pose):
        T, covariance = matrix_of(pose.pose), np.array(pose.covariance)
        if self.recipe.get(name + '_differential'):
            before, self.last[name] = self.last.get(name), (stamp, T, covariance)
            if before and any(self.recipe[name + '_config'][:6]):
                dt = (stamp - before[0]).to_sec()
                self.correct_twist_of(name, vector_of(np.linalg.inv(before[1]) @ T) / dt, (covariance + before[2]) * dt)
            return
        if self.recipe.get(name + '_relative'):
            T = np.linalg.inv(self.first.setdefault(name, T)) @ T
        self.correct(name, 'pose', 0, vector_of(T), covariance)

    def correct_twist_of(self, name, values, covariance):
        """As if the pose's flags were the twist's."""
        flags = self.recipe[name + '_config']
        self.recipe[name + '_config'] = [False] * 6 + flags[:6] + flags[12:]
        self.correct(name, 'twist', 6, values, covariance)
        self.recipe[name + '_config'] = flags

    def take(self, name, message):
        self.predict(message.header.stamp)
        if isinstance(message, Imu):
            rate = message.angular_velocity
            covariance = np.zeros((6, 6))
            covariance[3:, 3:] = np.array(message.angular_velocity_covariance).reshape(3, 3)
            self.correct(name, 'twist', 6, [0, 0, 0, rate.x, rate.y, rate.z], covariance)
        else:
            self.take_pose(name, message.header.stamp, message.pose)
        if isinstance(message, Odometry):
            twist = message.twist.twist
            values = [twist.linear.x, twist.linear.y, twist.linear.z, twist.angular.x, twist.angular.y, twist.angular.z]
            self.correct(name, 'twist', 6, values, message.twist.covariance)

    def set_pose(self, message):
        self.stamp = message.header.stamp
        self.state = np.concatenate((vector_of(matrix_of(message.pose.pose)), np.zeros(6)))
        self.covariance = np.eye(12) * LEAST
        self.covariance[:6, :6] = np.array(message.pose.covariance).reshape(6, 6)


class FilterTest(PipelineCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass(MadeUpSequence(PAIRS))
        transform = camera_transform(FRAME)
        q = transform.transform.rotation
        q.x, q.y, q.z, q.w = -np.sqrt(0.5), 0, 0, np.sqrt(0.5)
        cls.side_broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.side_broadcaster.sendTransform(transform)
        cls.recipes = recipes()

    def begin(self, **arguments):
        self.start(publish_tf='false', queue_size=100, **arguments)
        self.poses = self.collect('pose', PoseWithCovarianceStamped)
        self.resets = self.collect('set_pose', PoseWithCovarianceStamped)
        ended_by(self, subprocess.Popen(['rosrun', PACKAGE, 'filter_reset.py', '__ns:=' + self.namespace]))
        self.until(lambda: links(self.namespace + '/filter_reset') >= {
            ('out', self.resets.subscriber.resolved_name, rospy.get_name()), ('in', self.namespace + '/pose'),
            ('in', self.namespace + '/vo_info')})

    def lose(self, i):
        """A covered lens from pair i on, until the odometry is lost; the pair that comes next."""
        for k in range(i, PAIRS):
            if self.feed_messages(*self.camera.dark(k, frame=FRAME)).state == 'LOST':
                return k + 1
        self.fail('darkness did not lose it')

    def drive(self, begin, end):
        """Returns the odometry and the poses of the pairs that have some."""
        before = len(self.odometry)
        states = [self.feed(i, frame=FRAME).state for i in range(begin, end)]
        self.until(lambda: len(self.poses) == len(self.odometry))
        self.assertGreaterEqual(states.count('TRACKING'), len(states) - 2, states)
        return list(self.odometry)[before:], list(self.poses)[before:]

    @staticmethod
    def true_way(stamp):
        return STEP * round((stamp.to_sec() - EPOCH) / PERIOD)

    def assert_near(self, ekf, ahead, sigma_limit=4.0, limit=0.02):
        error = ekf.state[0] - ahead
        self.assertLess(abs(error), limit, (ekf.state[:6], ahead))
        self.assertLess(abs(error), 1e-3 + sigma_limit * np.sqrt(ekf.covariance[0, 0]))
        self.assertLess(np.abs(ekf.state[3:6]).max(), np.radians(1.0))

    def test_odometry_alone_with_the_reset_on_epoch(self):
        self.assertEqual(len(self.recipes), 4)
        recipe = self.recipes[0]
        self.begin()
        followed, left_alone = Filter(recipe), Filter(recipe)
        odometry, _ = self.drive(0, 8)
        again = self.lose(8)
        lost = len(self.odometry)
        for message in list(self.odometry):  # nothing came while it was lost
            for ekf in (followed, left_alone):
                ekf.take('odom0', message)
        self.assertEqual(followed.rejected, {})
        self.assert_near(left_alone, self.true_way(left_alone.stamp), limit=0.05)
        # Given a place far away, as an operator does.
        pose = PoseWithCovarianceStamped()
        pose.header.frame_id = 'odom'
        pose.pose.pose.position.x, pose.pose.pose.orientation.w = 50.0, 1.0
        pose.pose.covariance = np.diag([1e-4] * 6).ravel().tolist()
        resets = len(self.resets)
        answer = self.call('visual_odometry/set_pose', SetPose, pose)
        self.assertTrue(answer.success, answer.message)
        odometry, _ = self.drive(again, again + 8)
        self.until(lambda: len(self.resets) > resets)
        for message in odometry:
            left_alone.take('odom0', message)
            for reset in list(self.resets):
                if reset.header.stamp == message.header.stamp:
                    followed.set_pose(reset)
            followed.take('odom0', message)
        self.assertEqual(len(self.odometry), lost + len(odometry))
        self.assertEqual(followed.rejected, {})
        x = odometry[-1].pose.pose.position.x
        self.assertGreater(x, 45.0)
        self.assertLess(abs(followed.state[0] - x), 0.02)
        self.assertGreaterEqual(left_alone.rejected.get('odom0', 0), len(odometry) - 1, 'what the reset is for')

    def test_with_an_imu(self):
        """Of rates alone, with twists, which know nothing of where they begin; as poses relative to their beginning."""
        self.begin(config=self.config('visual_odometry: {initial_pose: 3 -2 0 0 0 0}'))
        ekf, with_default_noise = Filter(self.recipes[1], noise_of_twists()), Filter(self.recipes[1])
        relative = Filter(dict(self.recipes[1], odom0_config=self.recipes[0]['odom0_config'], odom0_relative=True))
        odometry, _ = self.drive(0, 14)
        random = np.random.RandomState(3)
        for message in odometry:
            imu = Imu(header=message.header)
            imu.angular_velocity.x, imu.angular_velocity.y, imu.angular_velocity.z = random.normal(0.0, 0.002, 3)
            imu.angular_velocity_covariance = np.diag([0.002 ** 2] * 3).ravel().tolist()
            for each in (ekf, relative, with_default_noise):
                each.take('odom0', message)
                each.take('imu0', imu)
        self.assertEqual((ekf.rejected, relative.rejected), ({}, {}))
        for each in (ekf, relative):
            self.assert_near(each, self.true_way(ekf.stamp), limit=0.05)
        sigma, by_default = (np.sqrt(each.covariance[0, 0]) for each in (ekf, with_default_noise))
        self.assertLess(sigma, 0.03)
        self.assertGreater(by_default, 5 * sigma, 'what config/robot_localization.yaml is for')

    def test_with_wheels_and_gnss(self):
        """The wheels slip; the odometry is lost and begins anew, which a differential pose bridges."""
        recipe = self.recipes[2]
        self.begin()
        ekf, without = Filter(recipe, noise_of_twists()), Filter(recipe, noise_of_twists())
        self.drive(0, 8)
        self.drive(self.lose(8), PAIRS)
        random = np.random.RandomState(4)
        poses = {pose.header.stamp: pose for pose in list(self.poses)}
        for k in range(PAIRS):
            stamp = rospy.Time.from_sec(EPOCH + PERIOD * k)
            wheels = Odometry()
            wheels.header.stamp = stamp
            wheels.twist.twist.linear.x = 1.1 * STEP / PERIOD  # slip
            wheels.twist.covariance = np.diag([0.02 ** 2] * 6).ravel().tolist()
            gnss = Odometry()
            gnss.header.stamp = stamp
            gnss.pose.pose.position.x, gnss.pose.pose.position.y = [STEP * k, 0.0] + random.normal(0.0, 0.05, 2)
            gnss.pose.pose.orientation.w = 1.0
            gnss.pose.covariance = np.diag([0.05 ** 2] * 6).ravel().tolist()
            for each in (ekf, without):
                each.take('odom0', wheels)
                if k % 10 == 0:
                    each.take('odom1', gnss)
            pose = next((p for s, p in poses.items() if abs((s - stamp).to_sec()) < 1e-6), None)
            if pose:
                ekf.take('pose0', pose)
        self.assertLessEqual(ekf.rejected.get('pose0', 0), 2)
        self.assertGreaterEqual(ekf.accepted['pose0'], len(poses) - 4)
        self.assertLess(abs(ekf.state[0] - STEP * (PAIRS - 1)), 0.2)
        self.assertLess(ekf.covariance[0, 0], without.covariance[0, 0])
        slip, slip_without = (each.state[6] / (STEP / PERIOD) - 1 for each in (ekf, without))
        self.assertLess(abs(slip), slip_without)
        self.assertGreater(slip_without, 0.07)

    def test_odometry_of_zeros_while_lost_moves_no_filter(self):
        self.begin(config=self.config('visual_odometry: {publish_null_when_lost: true}'))
        self.drive(0, 6)
        self.lose(6)
        self.until(lambda: self.odometry[-1].pose.covariance[0] == 9999.0)
        ekf = Filter(self.recipes[0])
        for message in list(self.odometry):
            ekf.take('odom0', message)
        self.assert_near(ekf, self.true_way(ekf.stamp), limit=0.05)


if __name__ == '__main__':
    rospy.init_node('filter_test')
    rostest.rosrun(PACKAGE, 'filter', FilterTest, sys.argv)
