#!/usr/bin/env python3
"""The example robot, launched as a user would but without rviz, on a rendered drive whose truth is exact."""

import os
import subprocess
import sys
import unittest

import numpy as np
import rosbag
import rospy
import rostest
import tf2_ros
from nav_msgs.msg import Odometry, Path

from kitti_replay import PACKAGE, Collector, converted, links, matrix_of, run_tool, temporary_folder, wait_until
from stereo_descriptor_vo.msg import VoInfo

PAIRS = 240  # 12 s: two stretches at least and the turn on the spot between them
LEFT, RIGHT = 'stereo_left_optical', 'stereo_right_optical'
TURN_RATE = 0.5  # rad/s; render_drive turns at up to 1 rad/s, and drives straight ahead between turns


def launch(*arguments):
    return ['roslaunch', '--wait', PACKAGE, 'example_robot.launch', 'rviz:=false'] + list(arguments)


class Drive:
    """What a bag of convert holds: the truth at each stamp, of a base whose origin is the left camera."""

    def __init__(self, path, truth):
        self.poses = {stamp: matrix_of(message.pose.pose) for stamp, message in truth.items()}
        with rosbag.Bag(path) as bag:
            mount = next(m for _, m, _ in bag.read_messages('/tf_static')).transforms[0]
            info = next(m for _, m, _ in bag.read_messages('/stereo/right/camera_info'))
        assert mount.child_frame_id == LEFT, mount
        self.T_base_camera = matrix_of(mount.transform)
        self.baseline = -info.P[3] / info.P[0]
        self.stamps = sorted(self.poses)

    def length(self, until):
        """Of the camera's way in m."""
        positions = np.array([self.poses[stamp][:3, 3] for stamp in self.stamps if stamp <= until])
        return np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()

    def of_base(self, stamp, T_base_camera, start):
        """The true pose of a base that carries the camera there and begins at `start`."""
        T_base_origin = T_base_camera @ np.linalg.inv(self.T_base_camera)
        return start @ T_base_origin @ self.poses[stamp] @ np.linalg.inv(T_base_origin)

    def turns(self, stamps):
        """(first, last) of the stamps between which the robot turns on the spot, by half a radian at least."""
        def yaw(stamp):
            return np.arctan2(self.poses[stamp][1, 0], self.poses[stamp][0, 0])

        def angle(first, last):
            return abs((yaw(last) - yaw(first) + np.pi) % (2 * np.pi) - np.pi)
        runs, begin = [], None
        for before, after in zip(stamps, stamps[1:]):
            turning = angle(before, after) > TURN_RATE * (after - before).to_sec()
            if turning and begin is None:
                begin = before
            if not turning and begin is not None:
                runs.append((begin, before))
                begin = None
        return [run for run in runs if angle(*run) > 0.5]


class ExampleRobot(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = temporary_folder(cls)
        drive = os.path.join(cls.directory, 'drive')
        run_tool('render_drive', '--trajectory', 'turn_in_place', '--rig', 'd435_small', '--frames', str(PAIRS), '--output',
                 drive)
        bag, truth = converted(drive, cls.directory)
        cls.drive = Drive(bag, truth)

        cls.odometry, cls.info = Collector('/stereo/odom', Odometry), Collector('/stereo/vo_info', VoInfo)
        cls.transforms = tf2_ros.Buffer(cache_time=rospy.Duration(60))
        listener = tf2_ros.TransformListener(cls.transforms)
        process = subprocess.Popen(launch('bag:=' + bag, 'ground_truth:=true'))
        try:
            needed = {('out', topic, rospy.get_name()) for topic in ('/stereo/odom', '/stereo/vo_info', '/tf')}
            needed.add(('in', '/stereo/stereo_features'))
            assert wait_until(lambda: links('/stereo/kitti_manager') >= needed and
                              ('out', '/tf_static', rospy.get_name()) in links('/robot_state_publisher'), 60), 'not connected'
            # The player waits for these.
            cls.ground_truth = [Collector('/ground_truth/odom', Odometry), Collector('/ground_truth/path', Path)]
            cls.status = process.wait(timeout=120)
        finally:
            process.terminate()
            process.wait()
        listener.unregister()
        cls.stamps = [message.header.stamp for message in cls.odometry]

    def transform(self, parent, child, stamp=rospy.Time(0)):
        return matrix_of(self.transforms.lookup_transform(parent, child, stamp).transform)

    def test_odometry_comes_for_every_pair(self):
        # The player's end ends the launch, which may be before the last pairs are done.
        self.assertLess((self.drive.stamps[-1] - self.stamps[-1]).to_sec(), 0.5)
        self.assertEqual(self.stamps, self.drive.stamps[:len(self.stamps)])
        self.assertEqual({message.state for message in self.info}, {'TRACKING'})
        self.assertEqual({(message.header.frame_id, message.child_frame_id) for message in self.odometry},
                         {('odom', 'base_link')})

    def test_transforms_lead_from_odom_to_both_cameras(self):
        T_base_left, T_base_right = self.transform('base_link', LEFT), self.transform('base_link', RIGHT)
        for message in self.odometry:
            stamp, pose = message.header.stamp, matrix_of(message.pose.pose)
            np.testing.assert_allclose(self.transform('odom', LEFT, stamp), pose @ T_base_left, atol=1e-6)
            np.testing.assert_allclose(self.transform('odom', RIGHT, stamp), pose @ T_base_right, atol=1e-6)
        # The robot's camera looks ahead as that of the bag, and its URDF has the baseline of camera_info.
        np.testing.assert_allclose(T_base_left[:3, :3], self.drive.T_base_camera[:3, :3], atol=1e-6)
        expected = np.eye(4)
        expected[0, 3] = self.drive.baseline
        np.testing.assert_allclose(np.linalg.inv(T_base_left) @ T_base_right, expected, atol=1e-6)

    def test_the_robot_begins_on_the_floor_and_ends_where_the_truth_does(self):
        T_base_camera, T_base_footprint = self.transform('base_link', LEFT), self.transform('base_link', 'base_footprint')
        np.testing.assert_allclose(self.transform('odom', 'base_footprint', self.stamps[0]), np.eye(4), atol=1e-6)
        stamp = self.stamps[-1]
        truth = self.drive.of_base(stamp, T_base_camera, np.linalg.inv(T_base_footprint))
        error = np.linalg.norm(matrix_of(self.odometry[-1].pose.pose)[:3, 3] - truth[:3, 3])
        length = self.drive.length(stamp)
        print('final error %.3f m after %.2f m' % (error, length))
        self.assertGreater(length, 1.0)
        self.assertLess(error, 0.02 + 0.02 * length)

    def test_base_link_stays_where_the_robot_turns_on_the_spot(self):
        poses = {message.header.stamp: matrix_of(message.pose.pose) for message in self.odometry}
        turns = self.drive.turns(self.stamps)
        self.assertGreaterEqual(len(turns), 1)
        for first, last in turns:
            camera = np.linalg.norm((self.drive.poses[last] - self.drive.poses[first])[:3, 3])
            base = np.linalg.norm((poses[last] - poses[first])[:3, 3])
            print('a turn moves the camera by %.3f m and base_link by %.3f m' % (camera, base))
            # The camera is on a circle of 0.1 m about the axle: a wrong mount would make base_link move as far.
            self.assertGreater(camera, 0.04)
            self.assertLess(base, 0.02)

    def test_a_missing_bag_is_named_with_what_makes_it(self):
        missing = os.path.join(self.directory, 'missing.bag')
        outcome = subprocess.run(launch('bag:=' + missing), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                 universal_newlines=True, timeout=60)
        self.assertNotEqual(outcome.returncode, 0)
        for words in (missing, 'scripts/demo --rig d435_small'):
            self.assertIn(words, outcome.stderr)


if __name__ == '__main__':
    rospy.init_node('example_robot_test')
    rostest.rosrun(PACKAGE, 'example_robot', ExampleRobot, sys.argv)
