#!/usr/bin/env python3
"""Each launch file of launch/cameras with its driver: odometry, and what is said of a camera_info that does not fit."""

import dataclasses
import subprocess
import sys
import unittest

import rospy
import rostest
from nav_msgs.msg import Odometry

import fake_driver
from kitti_replay import PACKAGE, Collector, Pipeline, Rosout, StereoSequence, links, wait_until
from stereo_descriptor_vo.msg import VoInfo

PAIRS = 6  # a metre straight ahead from each to the next


class Cameras(unittest.TestCase):
    tests = 0

    @classmethod
    def setUpClass(cls):
        cls.sequence = StereoSequence(PAIRS)

    def start_driver(self, habits, sequence):
        """The driver in a namespace of its own."""
        Cameras.tests += 1
        namespace = '%s_%d' % (habits.namespace, Cameras.tests)
        root, frames = habits.root, habits.frames
        if root == 'camera_link':  # the driver's prefix
            root, frames = namespace + '_link', tuple('%s_%s' % (namespace, frame) for frame in frames)
        elif root == 'base_link' or not root:
            frames = tuple('%s_%s' % (namespace, frame) for frame in frames)
        habits = dataclasses.replace(habits, namespace=namespace, root=root, frames=frames)
        self.driver = fake_driver.FakeDriver(habits, sequence)
        self.addCleanup(self.driver.close)
        return habits

    def start(self, habits):
        """The driver, and the launch file as a user would start it."""
        habits = self.start_driver(habits, self.sequence)
        namespace, frames = habits.namespace, habits.frames
        collectors = [Collector('/%s/odom' % namespace, Odometry), Collector('/%s/vo_info' % namespace, VoInfo)]
        self.odometry, self.info = collectors
        self.rosout = Rosout('/' + namespace)
        arguments = {'publish_tf': 'false'}  # the next test's robot has the same base
        if 'zed' not in habits.launch:  # its driver publishes the mount
            arguments['mount_rpy'] = '0 0 0 0 0 0'
        if habits.raw:
            arguments['left_frame_id'] = frames[0]
        if habits.emitter == 'on_off':
            arguments['emitter_on_off'] = 'true'
        pipeline = Pipeline('/' + namespace, habits.launch, **arguments)
        for closeable in collectors + [self.rosout, pipeline]:
            self.addCleanup(closeable.close)
        topics = self.driver.topics()
        if habits.emitter == 'on_off':
            left, unlit = self.driver.infos[0].resolved_name, '/%s/infra1/unlit/camera_info' % namespace
            self.assertTrue(wait_until(lambda: links('/%s/infra1/unlit_camera_info' % namespace) >= {
                ('in', left), ('in', self.driver.metadata.resolved_name), ('out', unlit, pipeline.manager)}, 60))
            topics = [unlit if topic == left else topic for topic in topics]
        if habits.raw:
            topics += ['/%s/%s/%s' % (namespace, side, what) for side in habits.sides for what in ('image_mono', 'image_rect')]
        needed = {('in', topic) for topic in topics + ['/tf_static']}
        needed |= {('out', c.subscriber.resolved_name, rospy.get_name()) for c in collectors}
        needed.add(('out', '/rosout', rospy.get_name()))
        # Both ends of each connection must have it, or the first pair is lost on the way.
        self.assertTrue(wait_until(lambda: self.driver.is_subscribed() and links(pipeline.manager) >= needed, 60),
                        'not connected: %s' % (needed - links(pipeline.manager)))

    def drive(self, habits):
        self.start(habits)
        for i in range(PAIRS):
            stamp = self.driver.publish(i)
            self.assertTrue(wait_until(lambda: self.info.has(stamp)), 'no answer to pair %d: %s' % (i, self.rosout.errors))
        self.assertTrue(wait_until(lambda: self.odometry.has(stamp)), self.rosout.errors)
        self.assertEqual({info.state for info in self.info[1:]}, {'TRACKING'})
        position = self.odometry[-1].pose.pose.position
        self.assertAlmostEqual(position.x, PAIRS - 1, delta=0.1)
        self.assertAlmostEqual(position.y, 0.0, delta=0.1)
        self.assertAlmostEqual(position.z, 0.0, delta=0.1)
        self.assertEqual(self.rosout.errors, [])

    def test_realsense(self):
        self.drive(fake_driver.REALSENSE)

    def test_pairs_that_the_projector_lights_are_left_out(self):
        self.start(dataclasses.replace(fake_driver.REALSENSE, emitter='on_off'))
        stamps = []
        for i in range(PAIRS):
            stamps.append(self.driver.publish(i))
            self.assertTrue(wait_until(lambda: self.info.has(stamps[i - i % 2])), self.rosout.errors)
        self.assertEqual([info.header.stamp for info in self.info], stamps[::2])
        self.assertEqual({info.state for info in self.info}, {'TRACKING'})
        self.assertTrue(wait_until(lambda: self.odometry.has(stamps[4])))
        self.assertAlmostEqual(self.odometry[-1].pose.pose.position.x, 4.0, delta=0.1)
        self.assertFalse(self.rosout.warned('emitter'), self.rosout.warnings)

    def test_a_projector_that_is_on_is_named(self):
        self.sequence = StereoSequence(2 * PAIRS)
        self.start(dataclasses.replace(fake_driver.REALSENSE, emitter='on'))
        for i in range(2 * PAIRS):
            stamp = self.driver.publish(i)
            self.assertTrue(wait_until(lambda: self.info.has(stamp)), self.rosout.errors)
        self.assertTrue(wait_until(lambda: self.rosout.warned('emitter: ', 'switch the pattern projector off')), self.rosout.warnings)

    def test_oak(self):
        self.drive(fake_driver.OAK)

    def test_zed(self):
        self.drive(fake_driver.ZED)

    def test_two_cameras_plumb_bob(self):
        self.drive(fake_driver.TWO)

    def test_two_cameras_rational(self):
        self.drive(dataclasses.replace(fake_driver.TWO, model='rational_polynomial'))

    def test_two_cameras_equidistant(self):
        self.drive(dataclasses.replace(fake_driver.TWO, model='equidistant'))

    def refuses(self, habits, words):
        self.start(habits)
        self.driver.publish(0)
        self.assertTrue(wait_until(lambda: self.rosout.said(words)), self.rosout.errors)
        self.assertEqual(len(self.odometry), 0)

    def test_reversed_oak_names_the_switch_of_its_driver(self):
        self.refuses(dataclasses.replace(fake_driver.OAK, reversed_pair=True), 'stereo_i_reverse_stereo_socket_order')

    def test_realsense_of_an_old_driver_has_no_baseline(self):
        self.refuses(dataclasses.replace(fake_driver.REALSENSE, without_tx=True), 'no baseline in P')

    def check_camera(self, habits):
        """Exit code and lines of check_camera beside the driver."""
        pairs = 40
        habits = self.start_driver(habits, StereoSequence(pairs))
        tool = subprocess.Popen(['rosrun', PACKAGE, 'check_camera', '--seconds', '8', '--camera', '/' + habits.namespace,
                                 '--left', habits.sides[0], '--right', habits.sides[1], '--image', habits.image,
                                 '--base-frame', habits.root], stdout=subprocess.PIPE, universal_newlines=True)
        self.assertTrue(wait_until(self.driver.is_subscribed, 30))
        for i in range(pairs):
            self.driver.publish(i)
            rospy.sleep(0.1)
        lines = tool.communicate()[0].splitlines()
        return tool.returncode, {line[5:19].strip(): line[:5].strip() for line in lines if not line.startswith(' ')}, lines

    def test_check_camera_listens_to_a_driver(self):
        code, verdicts, lines = self.check_camera(fake_driver.REALSENSE)
        self.assertEqual(code, 0, lines)
        for step in ('topics', 'calibration', 'rectification', 'exposure', 'texture', 'odometry', 'TF'):
            self.assertEqual(verdicts[step], 'OK', lines)
        self.assertEqual(verdicts['stamps'], 'WARN', 'a clock of its own: %s' % lines)

    def test_check_camera_names_the_calibration(self):
        code, verdicts, lines = self.check_camera(dataclasses.replace(fake_driver.REALSENSE, without_tx=True))
        self.assertEqual((code, verdicts['calibration']), (2, 'FAIL'), lines)
        self.assertIn('no baseline in P', ' '.join(lines))


if __name__ == '__main__':
    rospy.init_node('cameras_test')
    rostest.rosrun(PACKAGE, 'cameras', Cameras, sys.argv)
