#!/usr/bin/env python3
"""Replays a whole converted sequence through the launched pipeline and checks all that comes out.

Parameters: ~sequence of KITTI, for example "06", without it the rendered street; ~rate of the replay."""

import os
import sys
import unittest

import numpy as np
import rosbag
import rospy
import rostest
import tf2_ros
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage

from kitti_replay import (PACKAGE, Collector, converted, is_connected, kitti_dir, matrix_of, play, run_tool, street_dir,
                          temporary_folder, wait_until)
from stereo_descriptor_vo.msg import StereoFeatures, VoInfo

STATIC_FRAMES = ('base_link', 'stereo_left_optical')


class Replay(unittest.TestCase):
    """One replay; each test looks at another side of what it gave."""

    @classmethod
    def setUpClass(cls):
        name = rospy.get_param('~sequence', '')
        sequence = os.path.join(kitti_dir(), 'sequences', name) if name else street_dir()
        folder = temporary_folder(cls)
        bag, cls.truth = converted(sequence, folder)
        poses = os.path.join(folder, 'poses.txt')
        run_tool('run_sequence', sequence, '--poses', poses)
        cls.offline = np.loadtxt(poses).reshape(-1, 3, 4)
        with rosbag.Bag(bag) as recorded:
            cls.stamps = [m.header.stamp for _, m, _ in recorded.read_messages('/stereo/left/image_rect')]

        cls.odometry = Collector('/stereo/odom', Odometry)
        cls.features = Collector('/stereo/stereo_features', StereoFeatures)
        cls.info = Collector('/stereo/vo_info', VoInfo)
        cls.path = Collector('/stereo/path', Path)
        cls.points = Collector('/stereo/points', PointCloud2)
        cls.ground_truth = [Collector('/ground_truth/odom', Odometry), Collector('/ground_truth/path', Path)]
        cls.transforms = Collector('/tf', TFMessage)
        cls.tf = tf2_ros.Buffer(rospy.Duration(1000))
        cls.listener = tf2_ros.TransformListener(cls.tf)
        collectors = (cls.odometry, cls.features, cls.info, cls.path, cls.points, cls.transforms)
        connected = wait_until(lambda: is_connected('/stereo/stereo_vo_manager', collectors, ['/stereo/stereo_features']) and
                               cls.listener.tf_sub.get_num_connections() > 0, 60)
        assert connected, 'the nodelets are not connected within a minute'
        play(bag, '--rate', str(rospy.get_param('~rate')))
        pairs = len(cls.stamps)
        wait_until(lambda: all(len(c) >= pairs for c in (cls.odometry, cls.features, cls.info, cls.transforms)) and
                   all(len(c) > 0 and c[-1].header.stamp == cls.stamps[-1] for c in (cls.path, cls.points)) and
                   cls.tf.can_transform('odom', 'base_link', cls.stamps[-1]))

    def poses(self):
        return [matrix_of(odometry.pose.pose) for odometry in self.odometry]

    def test_one_of_everything_for_each_pair_with_its_stamp(self):
        self.assertGreater(len(self.stamps), 50)
        for collector in (self.odometry, self.features, self.info):
            self.assertEqual([m.header.stamp for m in collector], self.stamps)
        # Of points only the newest waits for a slow listener.
        stamps = [m.header.stamp for m in self.points]
        self.assertEqual(stamps, [stamp for stamp in self.stamps if stamp in stamps])
        self.assertEqual(stamps[-1], self.stamps[-1])
        self.assertGreater(len(stamps), len(self.stamps) // 2)

    def test_frames(self):
        for odometry in self.odometry:
            self.assertEqual(odometry.header.frame_id, 'odom')
            self.assertEqual(odometry.child_frame_id, 'base_link')
        for message in list(self.features) + list(self.points):
            self.assertEqual(message.header.frame_id, 'stereo_left_optical')

    def test_numbers_are_finite_and_quaternions_unit(self):
        for odometry in self.odometry:
            q, p = odometry.pose.pose.orientation, odometry.pose.pose.position
            t = odometry.twist.twist
            self.assertAlmostEqual(q.x ** 2 + q.y ** 2 + q.z ** 2 + q.w ** 2, 1.0, delta=1e-6)
            numbers = [p.x, p.y, p.z, t.linear.x, t.linear.y, t.linear.z, t.angular.x, t.angular.y, t.angular.z]
            self.assertTrue(np.all(np.isfinite(numbers)))
            self.assertTrue(np.all(np.isfinite(odometry.pose.covariance + odometry.twist.covariance)))

    def test_tf_equals_odometry_at_each_stamp(self):
        transforms = [t for message in self.transforms for t in message.transforms]
        self.assertEqual([t.header.stamp for t in transforms], self.stamps)
        for transform, odometry in zip(transforms, self.odometry):
            self.assertEqual((transform.header.frame_id, transform.child_frame_id), ('odom', 'base_link'))
            np.testing.assert_allclose(matrix_of(transform.transform), matrix_of(odometry.pose.pose), atol=1e-9)
            # As a user asks for it; tf2's python side rounds the stamp to some 10 ns.
            looked_up = self.tf.lookup_transform('odom', 'base_link', odometry.header.stamp)
            np.testing.assert_allclose(matrix_of(looked_up.transform), matrix_of(odometry.pose.pose), atol=1e-4)

    def test_path_holds_the_whole_trajectory(self):
        path = self.path[-1]
        self.assertEqual(path.header.frame_id, 'odom')
        self.assertEqual([pose.header.stamp for pose in path.poses], self.stamps)
        for pose, odometry in zip(path.poses, self.odometry):
            self.assertEqual(pose.pose, odometry.pose.pose)

    def test_covariances_are_valid_and_the_pose_gets_less_certain(self):
        traces = []
        for odometry in self.odometry:
            for covariance in (odometry.pose.covariance, odometry.twist.covariance):
                matrix = np.array(covariance).reshape(6, 6)
                np.testing.assert_array_equal(matrix, matrix.T)
                self.assertTrue(np.all(np.diag(matrix) > 0.0))
                eigenvalues = np.linalg.eigvalsh(matrix)
                self.assertGreaterEqual(eigenvalues[0], -1e-12 * eigenvalues[-1])
            traces.append(np.trace(np.array(odometry.pose.covariance).reshape(6, 6)))
        # What one pair is doubted by ends with it. What is open of the rig adds up, but shrinks as the rig is learnt.
        self.assertGreater(traces[-1], 0.5 * traces[len(traces) // 5])

    def test_position_stays_near_the_ground_truth(self):
        truth = [matrix_of(self.truth[stamp].pose.pose)[:3, 3] for stamp in self.stamps]
        length = sum(np.linalg.norm(b - a) for a, b in zip(truth, truth[1:]))
        self.assertGreater(length, 50.0)
        self.assertLess(np.linalg.norm(self.poses()[-1][:3, 3] - truth[-1]), 0.03 * length)
        np.testing.assert_allclose(self.poses()[0], np.eye(4), atol=1e-9)
        x = [pose[0, 3] for pose in self.poses()]
        self.assertTrue(all(b > a for a, b in zip(x, x[1:])), 'forward is not +x')

    def test_states(self):
        for info in self.info:
            self.assertEqual(info.state, 'TRACKING', info.reason)
            self.assertEqual(info.epoch, self.info[0].epoch)
            self.assertEqual((info.dropped_pairs, info.dropped_features, info.out_of_order, info.malformed),
                             (0, 0, 0, 0))
        for info in self.info[1:]:
            self.assertTrue(info.features >= info.matches >= info.inliers > 0)
            self.assertTrue(0.0 < info.inlier_ratio <= 1.0 and 0.0 < info.coverage <= 1.0)
            self.assertTrue(0.0 < info.rms_reprojection_error < 2.0)
        length = sum(np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in zip(self.poses(), self.poses()[1:]))
        self.assertAlmostEqual(self.info[-1].distance, length, delta=0.01 * length)

    def test_another_subscriber_reads_the_descriptors(self):
        for message, info in zip(self.features, self.info):
            n = len(message.u)
            self.assertGreater(n, 100)
            self.assertEqual(len(message.descriptors), n * message.bytes_per_row)
            self.assertEqual((message.element_type, message.layout), ('bits', 'left+right'))
            for values in (message.v, message.disparity, message.dv, message.size, message.angle, message.response):
                self.assertEqual(len(values), n)
            u, v, disparity = (np.array(a) for a in (message.u, message.v, message.disparity))
            self.assertTrue(np.all((u >= 0) & (u <= message.image_width - 1) & (v >= 0) & (v <= message.image_height - 1)))
            self.assertTrue(np.all(disparity > 0) and np.all(u - disparity >= 0))
            size = np.clip(message.size_slope * disparity ** message.size_exponent + message.size_offset,
                           message.size_min, message.size_max)
            np.testing.assert_allclose(message.size, size, rtol=1e-4)
            self.assertEqual(len(message.patches), n * message.patch_side ** 2)
            self.assertGreater(message.patch_side, 0)
            self.assertEqual(info.features, n)

    def test_trajectory_equals_that_of_run_sequence(self):
        static = matrix_of(self.tf.lookup_transform(*STATIC_FRAMES, rospy.Time(0)).transform)
        self.assertEqual(len(self.offline), len(self.poses()))
        for offline, online in zip(self.offline, self.poses()):
            camera = np.vstack((offline, [0, 0, 0, 1]))
            base = static @ camera @ np.linalg.inv(static)
            self.assertLess(np.linalg.norm(base[:3, 3] - online[:3, 3]), 1e-3)
            np.testing.assert_allclose(base[:3, :3], online[:3, :3], atol=1e-4)


if __name__ == '__main__':
    rospy.init_node('replay_test')
    rostest.rosrun(PACKAGE, 'replay', Replay, sys.argv)
