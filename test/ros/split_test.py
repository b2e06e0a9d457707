#!/usr/bin/env python3
"""Features on the robot, odometry in another process behind a link that is slow and breaks down."""

import io
import queue
import subprocess
import sys
import threading
import time
import unittest

import numpy as np
import rospy
import rostest
import tf2_ros
from nav_msgs.msg import Odometry

from kitti_replay import FRAME, PACKAGE, Camera, Collector, SimulatedClock, StereoSequence, links, matrix_of, wait_until
from pipeline_case import camera_transform
from stereo_descriptor_vo.msg import StereoFeatures, VoInfo

PAIRS = 24
DELAY = 0.3  # s, wall time
ROBOT, STATION = '/robot', '/station'


class Link:
    """Carries the features from one namespace to the other in their order: late, or not for a while (they wait then, as in a
    connection that stalls), or never."""

    def __init__(self):
        self.publisher = rospy.Publisher(STATION + '/stereo_features', StereoFeatures, queue_size=100)
        self.stalled = self.broken = False
        self.lost = 0
        self.on_the_way = queue.Queue()
        self.subscriber = rospy.Subscriber(ROBOT + '/stereo_features', StereoFeatures, self.take, queue_size=100)
        threading.Thread(target=self.deliver, daemon=True).start()

    def take(self, features):
        if self.broken:
            self.lost += 1
        else:
            self.on_the_way.put((time.time() + DELAY, features))

    def deliver(self):
        while True:
            due, features = self.on_the_way.get()
            while self.stalled or time.time() < due:
                time.sleep(0.005)
            self.publisher.publish(features)


class Split(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.sequence = StereoSequence(PAIRS)
        cls.clock = SimulatedClock()
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform(camera_transform(FRAME))
        cls.camera = Camera(ROBOT, cls.sequence, cls.clock)
        cls.features = Collector(ROBOT + '/stereo_features', StereoFeatures)
        cls.info, cls.odometry = Collector(STATION + '/vo_info', VoInfo), Collector(STATION + '/odom', Odometry)
        cls.link = Link()
        cls.processes = [subprocess.Popen(['roslaunch', '--wait', PACKAGE, file + '.launch', 'namespace:=' + namespace.strip('/')])
                         for file, namespace in (('features', ROBOT), ('odometry', STATION))]

        def is_connected():
            out = {('out', STATION + '/' + topic, rospy.get_name()) for topic in ('vo_info', 'odom')}
            return (cls.camera.is_subscribed() and links(STATION + '/odometry_manager') >= out | {('in', '/tf_static')} and
                    ('out', ROBOT + '/stereo_features', rospy.get_name()) in links(ROBOT + '/features_manager') and
                    ('out', STATION + '/stereo_features', STATION + '/odometry_manager') in links(rospy.get_name()))
        assert wait_until(is_connected, 60), 'the two sides did not start'

    @classmethod
    def tearDownClass(cls):
        for process in cls.processes:
            process.terminate()
            process.wait()

    def is_answered(self, i):
        """Whether a pair gives a VoInfo and a pose, in whatever order they come."""
        images, infos = self.camera.messages(i)
        self.camera.publish(images, infos)
        return wait_until(lambda: all(c.has(images[0].header.stamp) for c in (self.info, self.odometry)), 5.0)

    def send(self, pairs):
        """Returns when the image side is done with them."""
        for i in pairs:
            images, infos = self.camera.messages(i)
            self.camera.publish(images, infos)
            self.assertTrue(wait_until(lambda: self.features.has(images[0].header.stamp)))

    def test_a_link_that_is_late_stalls_and_breaks_down(self):
        # Late: each pair is measured, only later. Poses have the images' stamps.
        for i in range(6):
            self.assertTrue(self.is_answered(i))
        self.assertEqual({info.state for info in self.info}, {'TRACKING'})
        self.assertEqual([m.header.stamp for m in self.odometry], [m.header.stamp for m in self.features])

        # It stalls and then delivers all at once: the newest one wins, what is left out is counted, the gap is bridged.
        self.link.stalled = True
        self.send(range(6, 11))
        time.sleep(DELAY)  # all are due now
        self.link.stalled = False
        newest = self.features[-1].header.stamp
        self.assertTrue(wait_until(lambda: self.info.has(newest)))
        self.assertTrue(self.is_answered(11))
        self.assertEqual(self.info[-1].state, 'TRACKING')

        # It breaks down for half a second of the drive: the next pair is measured against the map.
        self.link.broken = True
        self.send(range(12, 17))
        self.assertTrue(wait_until(lambda: self.link.lost == 5))
        self.link.broken = False
        for i in range(17, PAIRS):
            self.assertTrue(self.is_answered(i))
        last = self.info[-1]
        self.assertEqual(last.state, 'TRACKING')
        self.assertEqual((last.epoch, last.malformed, last.out_of_order), (self.info[0].epoch, 0, 0))
        self.assertEqual(len(self.info) + last.dropped_features + 5, PAIRS)
        # 23 pairs, a metre each or somewhat more.
        self.assertGreater(np.linalg.norm(matrix_of(self.odometry[-1].pose.pose)[:3, 3]), 20.0)

        def megabytes(messages):
            buffer = io.BytesIO()
            for message in messages:
                message.serialize(buffer)
            return 1e-6 * buffer.tell()
        images, infos = self.camera.messages(0)
        print('\n*** a pair: %.2f MB of images, %.3f MB of features ***\n' %
              (megabytes(images + infos), megabytes(self.features) / PAIRS), flush=True)


if __name__ == '__main__':
    rospy.init_node('split_test')
    rostest.rosrun(PACKAGE, 'split', Split, sys.argv)
