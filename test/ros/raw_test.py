#!/usr/bin/env python3
"""Replays raw images of EuRoC through stereo_raw.launch: rectified in the odometry's own manager, without a copy, and the
trajectory is that of the drone.

Parameter: ~rate of the replay."""

import os
import subprocess
import sys
import unittest
import xmlrpc.client

import numpy as np
import rosgraph
import rospy
import rostest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo

from kitti_replay import PACKAGE, Collector, converted, data_dir, is_connected, matrix_of, temporary_folder, wait_until
from stereo_descriptor_vo.msg import VoInfo

MANAGER = '/stereo/stereo_vo_manager'
# Of the bag, and as a camera may call them.
NAMES = {'/stereo/%s/%s' % (side, what): '/%s/%s' % (camera, what)
         for side, camera in (('left', 'cam0'), ('right', 'cam1')) for what in ('image_raw', 'camera_info')}


def transports(node):
    """How each topic comes into a node."""
    uri = rosgraph.Master('/test').lookupNode(node)
    connections = xmlrpc.client.ServerProxy(uri).getBusInfo('/test')[2]
    return {c[4]: c[3] for c in connections if c[2] == 'i'}


class Raw(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        recording = os.path.join(data_dir('EUROC_DIR', 'MH_01_moving'), 'MH_01_moving', 'mav0')
        bag, cls.truth = converted(recording, temporary_folder(cls))
        cls.stamps = sorted(cls.truth)

        cls.odometry = Collector('/stereo/odom', Odometry)
        cls.info = Collector('/stereo/vo_info', VoInfo)
        cls.cameras = [Collector('/stereo/%s/rectifiable/camera_info' % side, CameraInfo) for side in ('left', 'right')]
        inputs = ['/stereo/%s/%s' % (side, what) for side in ('left', 'right') for what in ('image_mono', 'image_rect')]
        inputs += NAMES.values()
        player = subprocess.Popen(['rosbag', 'play', '--quiet', '--clock', '--wait-for-subscribers', '--rate',
                                   str(rospy.get_param('~rate')), bag, '--topics', *NAMES, '/tf_static'] +
                                  ['%s:=%s' % names for names in NAMES.items()])
        try:
            cls.connected = wait_until(lambda: is_connected(MANAGER, (cls.odometry, cls.info), inputs), 60)
            cls.transports = transports(MANAGER)
            assert player.wait() == 0
        finally:
            player.kill()
            player.wait()
        wait_until(lambda: len(cls.odometry) >= len(cls.stamps) and len(cls.info) >= len(cls.stamps))

    def test_every_pair_is_tracked(self):
        self.assertEqual([message.header.stamp for message in self.odometry], self.stamps)
        self.assertEqual({message.state for message in self.info}, {'TRACKING'})

    def test_images_have_the_field_of_view_that_was_asked_for(self):
        f = 752 / 2 / np.tan(np.radians(80 / 2))
        for camera, baseline in zip(self.cameras, (0.0, 0.11)):
            P = np.reshape(camera[0].P, (3, 4))
            np.testing.assert_allclose(P[:, :3], [[f, 0, 375.5], [0, f, 239.5], [0, 0, 1]])
            self.assertAlmostEqual(-P[0, 3] / f, baseline, places=3)

    def test_images_stay_in_the_manager(self):
        self.assertTrue(self.connected)
        for side in ('left', 'right'):
            for what in ('image_mono', 'image_rect'):
                self.assertEqual(self.transports['/stereo/%s/%s' % (side, what)], 'INTRAPROCESS')

    def test_trajectory_is_that_of_the_drone(self):
        truth = [matrix_of(self.truth[stamp].pose.pose) for stamp in self.stamps]
        length = sum(np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in zip(truth, truth[1:]))
        self.assertGreater(length, 0.5)
        for odometry, true in zip(self.odometry, truth):
            error = np.linalg.inv(true) @ matrix_of(odometry.pose.pose)
            self.assertLess(np.linalg.norm(error[:3, 3]), 0.01 + 0.03 * length)
            self.assertLess(np.degrees(np.arccos(min(1.0, (np.trace(error[:3, :3]) - 1) / 2))), 1.0)


if __name__ == '__main__':
    rospy.init_node('raw_test')
    rostest.rosrun(PACKAGE, 'raw', Raw, sys.argv)
