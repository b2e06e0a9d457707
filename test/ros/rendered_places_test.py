#!/usr/bin/env python3
"""A rendered figure eight, one lap and a bit, through the launched pipeline with loop closing: where it comes by again it is
recognised, and nowhere else. Needs no data set."""

import os
import sys
import unittest

import numpy as np
import rospy
import rostest
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from kitti_replay import PACKAGE, Collector, converted, is_connected, matrix_of, play, run_tool, temporary_folder, wait_until
from rendered_test import CALIBRATION, SIZE
from stereo_descriptor_vo.msg import PlaceInfo

RATE, PAIRS = 4.0, 215  # Hz; a lap takes 50.3 s


class RenderedPlaces(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = temporary_folder(cls)
        drive = os.path.join(folder, 'drive')
        run_tool('render_drive', '--trajectory', 'figure_eight', '--rate', str(RATE), '--frames', str(PAIRS), '--calib', CALIBRATION,
                 '--size', SIZE, '--output', drive)
        bag, truth = converted(drive, folder)
        cls.truth = {stamp: matrix_of(message.pose.pose) for stamp, message in truth.items()}

        cls.odometry, cls.info = Collector('/stereo/odom', Odometry), Collector('/stereo/place_info', PlaceInfo)
        cls.tf = Collector('/tf', TFMessage)
        cls.ground_truth = Collector('/ground_truth/odom', Odometry)
        inputs = ['/stereo/' + topic for topic in ('stereo_features', 'odom', 'vo_info')]
        connected = wait_until(lambda: is_connected('/stereo/stereo_vo_manager', (cls.odometry, cls.info, cls.tf), inputs), 60)
        assert connected, 'the nodelets are not connected'
        play(bag, '--rate', '2', '--topics', '/stereo/left/image_rect', '/stereo/right/image_rect', '/stereo/left/camera_info',
             '/stereo/right/camera_info', '/ground_truth/odom', '/tf_static', '--bags')
        wait_until(lambda: len(cls.odometry) >= PAIRS)
        cls.settled = wait_until(lambda: cls.info and (cls.odometry[-1].header.stamp - cls.info[-1].header.stamp).to_sec() < 3.0)

    def test_where_it_comes_by_again_it_is_recognised_and_nowhere_else(self):
        self.assertTrue(self.settled)
        stamps = {message.id: message.header.stamp for message in self.info}
        self.assertEqual((self.info[-1].dropped_pairs, self.info[-1].malformed), (0, 0))
        recognised = [message for message in self.info if message.same >= 0]
        for message in recognised:
            offset = np.linalg.inv(self.truth[stamps[message.same]]) @ self.truth[message.header.stamp]
            self.assertLess(np.linalg.norm(offset[:3, 3]), 15.0, 'key frame %d at %d' % (message.id, message.same))
            self.assertGreater(offset[0, 0], 0.7, 'key frame %d looks another way than %d' % (message.id, message.same))
        self.assertGreaterEqual(self.info[-1].loops, 1)

        # The map's own error stays small: the odometry of a rendered drive hardly drifts.
        last = self.odometry[-1]
        map_to_odom = matrix_of(self.info[-1].map_to_odom)
        in_map = map_to_odom @ matrix_of(last.pose.pose)
        first, truth = self.truth[self.odometry[0].header.stamp], self.truth[last.header.stamp]
        self.assertLess(np.linalg.norm((np.linalg.inv(first) @ truth)[:3, 3] - in_map[:3, 3]), 0.5)

    def test_odom_to_base_is_the_odometrys(self):
        poses = {m.header.stamp: matrix_of(m.pose.pose) for m in self.odometry}
        seen = 0
        for transform in [t for m in self.tf for t in m.transforms]:
            self.assertIn((transform.header.frame_id, transform.child_frame_id), {('map', 'odom'), ('odom', 'base_link')})
            if transform.child_frame_id == 'base_link':
                seen += 1
                self.assertLess(np.abs(matrix_of(transform.transform) - poses[transform.header.stamp]).max(), 1e-9)
        self.assertEqual(seen, PAIRS)


if __name__ == '__main__':
    rospy.init_node('rendered_places_test')
    rostest.rosrun(PACKAGE, 'rendered_places', RenderedPlaces, sys.argv)
