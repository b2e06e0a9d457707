#!/usr/bin/env python3
"""Renders a drive with turns and a stop, converts it to a bag, replays it through the launched pipeline and compares what
comes out with the exact ground truth. Needs no data set.

Parameter: ~rate of the replay."""

import os
import sys
import unittest

import numpy as np
import rospy
import rostest
from nav_msgs.msg import Odometry, Path

from kitti_replay import PACKAGE, Collector, converted, is_connected, matrix_of, play, run_tool, temporary_folder, wait_until
from stereo_descriptor_vo.msg import VoInfo

RATE = 10.0  # Hz
STOP = range(150, 200)  # pairs during which the car stands still
# A quarter of KITTI's pixels, for the sake of time.
CALIBRATION = os.path.join(os.path.dirname(os.path.realpath(__file__)), 'street_calib.txt')
SIZE = '620x188'


def planned_drive():
    """Poses of the left camera, 3x4, in KITTI's axes (x right, y down, z forward): off, a left turn, a stop, a right turn."""
    position, heading, poses = np.zeros(3), 0.0, []
    speed = 4.0
    for k in range(320):
        c, s = np.cos(heading), np.sin(heading)
        rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        poses.append(np.hstack([rotation, position[:, None]]))
        braking, leaving = 110 <= k < STOP[0], k >= STOP[-1]
        if braking:
            speed = max(0.0, speed - 0.22)
        elif k in STOP:
            speed = 0.0
        elif k < 110 or leaving:
            speed = min(8.0, speed + 0.15)
        turn = -np.pi / 2 / 50 if 60 <= k < 110 else np.pi / 3 / 60 if 240 <= k < 300 else 0.0
        heading += turn
        position = position + rotation @ [0, 0, speed / RATE]
    return np.array(poses)


class RenderedDrive(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = temporary_folder(cls)
        drive, poses = os.path.join(folder, 'drive'), os.path.join(folder, 'plan.txt')
        np.savetxt(poses, planned_drive().reshape(-1, 12))
        run_tool('render_drive', '--trajectory', poses, '--rate', str(RATE), '--calib', CALIBRATION, '--size', SIZE,
                 '--output', drive)
        bag, cls.truth = converted(drive, folder)
        cls.stamps = sorted(cls.truth)

        cls.odometry = Collector('/stereo/odom', Odometry)
        cls.info = Collector('/stereo/vo_info', VoInfo)
        cls.planar = Collector('/planar/odom', Odometry)
        cls.ground_truth = [Collector('/ground_truth/odom', Odometry), Collector('/ground_truth/path', Path)]
        for manager, collectors in (('/stereo/stereo_vo_manager', (cls.odometry, cls.info)),
                                    ('/planar/odometry_manager', (cls.planar, ))):
            assert wait_until(lambda: is_connected(manager, collectors, ['/stereo/stereo_features']), 60), manager
        play(bag, '--rate', str(rospy.get_param('~rate')))
        wait_until(lambda: min(map(len, (cls.odometry, cls.info, cls.planar))) >= len(cls.stamps))
        cls.estimated = [matrix_of(message.pose.pose) for message in cls.odometry]
        cls.true = [matrix_of(cls.truth[stamp].pose.pose) for stamp in cls.stamps]

    def test_every_pair_is_tracked(self):
        self.assertGreaterEqual(len(self.stamps), 300)
        self.assertEqual([message.header.stamp for message in self.odometry], self.stamps)
        self.assertEqual({message.state for message in self.info}, {'TRACKING'})
        self.assertEqual(self.info[-1].dropped_pairs, 0)

    def test_the_drive_turns_left_then_right(self):
        def yaw(pose):
            return np.degrees(np.arctan2(pose[1, 0], pose[0, 0]))
        self.assertAlmostEqual(yaw(self.estimated[STOP[0]]), 90.0, delta=1.0)
        self.assertAlmostEqual(yaw(self.estimated[-1]), 30.0, delta=1.0)

    def test_position_follows_the_exact_truth(self):
        travelled = 0.0
        for k in range(1, len(self.true)):
            travelled += np.linalg.norm(self.true[k][:3, 3] - self.true[k - 1][:3, 3])
            error = np.linalg.norm(self.estimated[k][:3, 3] - self.true[k][:3, 3])
            self.assertLess(error, 0.05 + 0.015 * travelled, 'pair %d' % k)
        self.assertGreater(travelled, 100.0)

    def test_a_planar_robot_stays_on_its_floor(self):
        self.assertEqual([message.header.stamp for message in self.planar], self.stamps)
        planar = [matrix_of(message.pose.pose) for message in self.planar]
        for pose, message in zip(planar, self.planar):
            self.assertLess(abs(pose[2, 3]), 0.01, 'height at %s' % message.header.stamp)
            # Of the floor, and of the mount's tilt by the motions, which its own height then confirms.
            self.assertLess(np.sqrt(message.pose.covariance[14]), 0.03)

        def largest_error(poses):
            return max(np.linalg.norm(pose[:2, 3] - true[:2, 3]) for pose, true in zip(poses, self.true))
        # The floor costs no more than a permille of the way.
        self.assertLess(largest_error(planar), largest_error(self.estimated) + 0.05 + 0.001 * self.info[-1].distance)

    def test_standing_still_is_standing_still(self):
        # The first pairs of the stop still refine what was measured while driving.
        still = self.estimated[STOP[0] + 5:STOP[-1]]
        for pose in still:
            self.assertLess(np.linalg.norm(pose[:3, 3] - still[0][:3, 3]), 0.01)

    def test_twist_follows_the_exact_truth(self):
        for stamp, odometry in list(zip(self.stamps, self.odometry))[1:]:
            actual, expected = odometry.twist.twist, self.truth[stamp].twist.twist
            self.assertAlmostEqual(actual.linear.x, expected.linear.x, delta=0.15 + 0.05 * abs(expected.linear.x))
            self.assertAlmostEqual(actual.angular.z, expected.angular.z, delta=0.03)


if __name__ == '__main__':
    rospy.init_node('rendered_test')
    rostest.rosrun(PACKAGE, 'rendered_drive', RenderedDrive, sys.argv)
