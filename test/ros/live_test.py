#!/usr/bin/env python3
"""A camera that misbehaves in every way we know, on the launched pipeline. The test is the camera and the clock, and
waits for the answer to each pair, so that nothing depends on the machine's speed."""

import copy
import itertools
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from unittest import mock

import cv2
import numpy as np
import roslib.packages
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Pose, PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry, Path
from nodelet.srv import NodeletUnload
from sensor_msgs.msg import Image, Imu, PointCloud2
from std_srvs.srv import Empty, Trigger
from tf2_msgs.msg import TFMessage

from kitti_replay import (EPOCH, FRAME, PACKAGE, Camera, Collector, Pipeline, StereoSequence, ended_by, links, load_nodelet,
                          matrix_of, nodelet_process, transforms_to, wait_until)
from pipeline_case import PipelineCase, camera_transform, planar_transform
from stereo_descriptor_vo.msg import FeatureFlow, PlaceInfo, StereoFeatures, VoInfo
from stereo_descriptor_vo.srv import ResetToPose, SaveTrajectory, SetPose

PAIRS = 14  # 1.3 s: a jump back to the first one is no mere lateness


class Live(PipelineCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass(StereoSequence(PAIRS))

    def test_images_are_subscribed_only_while_someone_listens(self):
        camera = self.keep(Camera(self.namespace, self.sequence, self.clock))
        self.diagnostics = self.keep(Collector('/diagnostics', DiagnosticArray))
        process = ended_by(self, nodelet_process('standalone', PACKAGE + '/StereoFeatures', '__ns:=' + self.namespace,
                                                 '__name:=stereo_features'))
        topic = node = self.namespace + '/stereo_features'
        # By then it has started and would have told the master of a subscription.
        self.until(lambda: 'nobody listens' in self.diagnosis('input rate', 'stereo_features').message)
        subscribed = {name for name, nodes in rospy.get_master().getSystemState()[2][1] if node in nodes}
        self.assertFalse({publisher.resolved_name for publisher in camera.images + camera.infos} & subscribed)
        listener = Collector(topic, StereoFeatures)
        self.until(lambda: camera.is_subscribed() and ('out', topic, rospy.get_name()) in links(node))
        camera.publish(*camera.messages(0))
        self.until(lambda: len(listener) == 1)
        listener.close()
        self.until(lambda: not camera.has_subscribers())
        self.assertIsNone(process.poll())

    def test_both_nodelets_in_one_process(self):
        """Started by hand: remapped, with private parameters of either nodelet, flat or in blocks."""
        camera = self.keep(Camera(self.namespace + '/front', self.sequence, self.clock))
        odometry = self.collect('odom', Odometry)
        node = self.namespace + '/stereo_odometry'
        command = [roslib.packages.find_node(PACKAGE, 'stereo_odometry')[0], '__ns:=' + self.namespace]
        command += ['%s:=front/%s' % (topic, topic) for topic in
                    ('left/image_rect', 'right/image_rect', 'left/camera_info', 'right/camera_info')]
        process = subprocess.Popen(command + ['_odom_frame_id:=world', '_detector/max_features:=600', '_queue_size:=100',
                                              '_visual_odometry/planar:=true', '_left_image/image_transport:=raw',
                                              '_max_featurs:=600'], stderr=subprocess.PIPE, universal_newlines=True)
        try:
            self.until(lambda: camera.is_subscribed() and links(node) >= {
                ('out', odometry.subscriber.resolved_name, rospy.get_name()), ('in', '/tf_static'),
                ('in', self.namespace + '/stereo_features')}, 60)
            for i in range(3):
                camera.publish(*camera.messages(i))
            self.until(lambda: len(odometry) == 3)
            self.assertEqual((odometry[2].header.frame_id, odometry[2].child_frame_id), ('world', 'base_link'))
            used = rospy.get_param(self.namespace)
            self.assertEqual((used['stereo_features']['detector']['max_features'], used['stereo_features']['queue_size'],
                              used['visual_odometry']['queue_size'], used['visual_odometry']['planar']), (600, 100, 100, True))
            self.assertEqual(used['stereo_features']['left_image']['image_transport'], 'raw')
            process.send_signal(signal.SIGTERM)  # of systemd; as Ctrl-C
            said = process.communicate(timeout=30)[1]
            self.assertEqual(process.returncode, 0)
        finally:
            process.kill()
        for name in (node + '/odom_frame_id', self.namespace + '/visual_odometry/odom_frame_id'):
            self.assertFalse(rospy.has_param(name), name + ' is for the next process, too')
        self.assertEqual(re.findall('parameter (.*) is unknown', said), [node + '/max_featurs'])
        self.assertNotEqual(subprocess.run(command + ['_queue_size:=many']).returncode, 0)

    def test_malformed_features(self):
        """What is malformed is for the view's own test."""
        self.start(queue_size=100)
        publisher = self.publisher('stereo_features', StereoFeatures)
        for i in range(3):
            self.assertEqual(self.feed(i).state, 'TRACKING')
        good = self.features[2]

        def damaged(**fields):
            message = copy.copy(good)
            message.header = copy.deepcopy(good.header)
            message.header.stamp += rospy.Duration.from_sec(0.01)
            for name, value in fields.items():
                setattr(message, name, value)
            return message
        for message, words in ((damaged(v=good.v[:-1]), 'v has'), (damaged(layout='sideways'), 'sideways')):
            publisher.publish(message)
            self.until(lambda: self.rosout.said('refused', words))
            self.assertEqual(len(self.info), 3)

        # A flood of the same is one error in five seconds. How many of it are seen depends on the queues.
        errors, start = len(self.rosout.errors), time.time()
        for _ in range(20):
            publisher.publish(damaged(layout='flood'))
        self.until(lambda: self.rosout.said('flood'))
        # Nothing orders the flood and the next pairs, of which it may push one out of the queue.
        for i in range(3, PAIRS):
            if self.is_answered(i) and self.info[-1].malformed > 4:
                break
        info = self.info[-1]
        self.assertTrue(4 < info.malformed <= 22 - info.dropped_features, info.malformed)
        self.assertLessEqual(len(self.rosout.errors) - errors, 1 + (time.time() - start) // 5.0)
        self.assertEqual((info.state, info.epoch), ('TRACKING', self.info[0].epoch))
        self.assert_alive()

    def test_bad_calibration_and_images(self):
        """Each of what the conversions' own tests refuse: one of camera_info, one of both, one of an image."""
        self.start()
        first = self.feed(0)
        self.assertEqual(first.state, 'TRACKING')

        def swapped(images, infos):
            infos[0].P, infos[1].P = infos[1].P, infos[0].P

        def other_size(images, infos):
            for info in infos:
                info.width, info.height = 640, 480

        def truncated(images, infos):
            images[0].data = images[0].data[:-1000]
        cases = ((swapped, ('baseline', 'swapped', 'Tx')), (other_size, ('640x480', )), (truncated, ('malformed', )))
        for k, (damage, words) in enumerate(cases):
            with self.subTest(damage.__name__):
                images, infos = self.camera.messages(1, time_of=1 + 0.1 * k)
                damage(images, infos)
                self.camera.publish(images, infos)
                self.until(lambda: self.rosout.said(*words))
        info = self.feed(2)
        self.assertEqual((info.state, info.epoch), ('TRACKING', first.epoch))
        self.assert_only([first, info])
        self.assert_alive()

    def test_missing_transform(self):
        self.start()
        points = self.collect('points', PointCloud2)
        picture = self.collect('features_image', Image)
        self.until(lambda: self.pipeline.is_connected((points, picture)) and
                   ('in', self.namespace + '/feature_flow') in links(self.pipeline.manager))
        frame = 'camera_without_transform'
        self.camera.publish(*self.camera.messages(0, frame=frame))
        self.until(lambda: self.rosout.said("'%s'" % frame, "'base_link'"))
        self.camera.publish(*self.camera.messages(1, frame=frame))
        self.until(lambda: len(self.features) == 2)  # the image side needs no transform
        # Each pair is answered with what is missing, and so are the diagnostics.
        self.until(lambda: len(self.info) == 2)
        for info in self.info:
            self.assertEqual((info.state, info.epoch), ('WAITING', 0))
            self.assertIn("'%s'" % frame, info.reason)
            self.assertGreater(info.detected, 0)
        self.until(lambda: (len(points), len(picture)) == (2, 2))
        self.until(lambda: self.diagnosis().message.startswith('WAITING: no transform'))
        self.assertEqual(len(self.odometry), 0)
        # Once it is there, and the listener has it, the odometry begins by itself.
        self.broadcaster.sendTransform([camera_transform(FRAME), camera_transform(frame)])
        times = itertools.count(2)
        self.until(lambda: self.feed(2, time_of=next(times), frame=frame).state == 'TRACKING')
        for i in (3, 4):
            self.assertEqual(self.feed(i, time_of=next(times), frame=frame).state, 'TRACKING')
        self.assertEqual(len(self.odometry), 3)
        self.assert_alive()

    def test_clock_jump_is_a_reset(self):
        self.clock.jump_to(rospy.Time.from_sec(EPOCH))  # tests before carried it on, and a jump of stamps must be the clock's
        self.start()
        path = self.listen('path', Path)
        first = [self.feed(i) for i in range(PAIRS)]
        diagnosed = len(self.diagnostics)
        self.clock.jump_to(self.info[0].header.stamp)
        # Nothing orders the clock and the images. Diagnostics have the time that the pipeline has.
        self.until(lambda: any(array.header.stamp == self.clock.now and self.is_ours(array)
                               for array in list(self.diagnostics)[diagnosed:]))
        second = [self.feed(i) for i in range(PAIRS)]
        # The same way from the origin again.
        self.assertEqual({info.epoch for info in first}, {first[0].epoch})
        self.assertEqual({info.epoch for info in second}, {first[0].epoch + 1})
        self.assertEqual((second[0].distance, second[-1].distance), (0.0, first[-1].distance))
        self.assertEqual(second[-1].dropped_pairs, 0)
        self.assertEqual(len(self.odometry), 2 * PAIRS)
        for a, b in zip(self.odometry[:PAIRS], self.odometry[PAIRS:]):
            self.assertEqual((a.pose, a.twist), (b.pose, b.twist))
        self.until(lambda: len(path) > 0 and path[-1].header.stamp == second[-1].header.stamp)
        self.assertEqual(len(path[-1].poses), PAIRS)

    def test_lasting_jumps_of_the_stamps_go_on_in_the_map_and_lose_nothing(self):
        """As where the camera's or the system's clock is set: the images go on."""
        self.start(queue_size=2)  # the pair held back and the next one come at once
        jumps = {5: -37.0, 10: 3600.0}  # s, by the pair that is the first with it
        jump, i = 0.0, 0
        while i < PAIRS:
            jump = jumps.get(i, jump)
            # The first pair after a jump waits for the next one to confirm it.
            count = 2 if i in jumps else 1
            for pair in range(i, i + count):
                self.clock.advance_to(rospy.Time.from_sec(EPOCH + 0.1 * pair))
                time.sleep(0.1)  # nothing orders the clock and the images
                images, infos = self.camera.messages(pair, time_of=pair + 10 * jump)
                self.camera.send(images, infos)
            i += count
            self.until(lambda: len(self.info) == len(self.odometry) == i)
        # A clock that is late shifts the moment of the jump by a pair: its motion is doubtful then, and right.
        self.assertEqual({info.epoch for info in self.info}, {self.info[0].epoch})
        self.assertLessEqual([info.state for info in self.info].count('DEGRADED'), len(jumps))
        self.assertEqual(self.info[-1].dropped_pairs, 0)
        ahead = self.odometry[-1].pose.pose.position.x - self.odometry[0].pose.pose.position.x
        self.assertGreater(ahead, PAIRS - 1.1)  # 1 m a pair on the street, 1.2 m where KITTI 06 stands for it
        self.assertAlmostEqual(self.info[-1].distance, ahead, delta=0.1)
        for way in ('back', 'ahead'):
            self.assertTrue(self.rosout.warned('stamps of the features jumped ' + way), self.rosout.warnings)

    def test_single_outliers_among_the_stamps_are_dropped_and_counted(self):
        self.start()
        outliers = (-300, 300, -9999.9, 20000)  # tenths of a second; the third is 10 ms after zero
        for i, outlier in enumerate(outliers):
            self.assertEqual(self.feed(i).state, 'TRACKING')
            images, infos = self.camera.messages(i, time_of=i + outlier)
            self.camera.send(images, infos)
        zero, infos = self.camera.messages(len(outliers))
        for publisher, message in zip(self.camera.infos + self.camera.images, infos + zero):
            message.header.stamp = rospy.Time()
            publisher.publish(message)
        self.until(lambda: self.rosout.said('left/image_rect', 'zero stamp'))
        for i in range(len(outliers), PAIRS):
            info = self.feed(i)
            self.assertEqual((info.state, info.epoch), ('TRACKING', self.info[0].epoch))
        self.assertEqual((len(self.info), info.dropped_pairs), (PAIRS, len(outliers) + 1))

    def test_a_topic_in_the_future_does_not_keep_pairs_from_being_synchronised(self):
        self.start()
        self.assertEqual(self.feed(0).state, 'TRACKING')
        for i in range(25):  # more than sync_queue_size
            images, _ = self.camera.messages(1, time_of=50000 + i)
            self.camera.images[0].publish(images[0])
        # They may come in the midst of a pair, which then makes room for them.
        self.assertTrue(any(self.is_answered(i) for i in range(1, 6)))
        for i in range(6, 9):
            self.assertIn(self.feed(i).state, ('TRACKING', 'DEGRADED'))

    def test_extreme_stamps(self):
        """Every subscriber of the pipeline gets them."""
        self.start(queue_size=100)  # none pushes another one out
        self.listen('features_image', Image)
        features, flow = self.publisher('stereo_features', StereoFeatures), self.publisher('feature_flow', FeatureFlow)
        tf = self.publisher('/tf', TFMessage)
        tf_static = self.broadcaster.pub_tf  # another one would replace what is latched
        info = self.feed(0)
        for seconds in (0, 1, 2**31 - 1, 2**31, 2**32 - 1):
            stamp = rospy.Time(seconds, 999999999 if seconds else 0)
            images, infos = self.camera.messages(0)
            messages = list(zip(self.camera.infos + self.camera.images, infos + images))
            messages += [(features, copy.copy(self.features[0])), (flow, FeatureFlow())]
            for publisher, message in messages:
                message.header = copy.deepcopy(message.header)
                message.header.stamp = stamp
                publisher.publish(message)
            transform = camera_transform('camera_of_another_time')
            transform.header.stamp = stamp
            tf.publish(TFMessage([transform]))
            tf_static.publish(TFMessage([transform]))
            self.broadcaster.sendTransform(camera_transform(FRAME))  # latched again
        # Who answers a pair has taken the images before it. Three features are counted as unusable once all have come.
        for i in range(1, PAIRS):
            self.until(lambda: self.is_answered(i))
            self.assertEqual((self.info[-1].state, self.info[-1].epoch), ('TRACKING', info.epoch))
            if i >= 3 and self.info[-1].malformed == info.malformed + 3:
                break
        self.assertEqual(self.info[-1].malformed, info.malformed + 3)
        self.assert_alive()

    def test_extreme_stamps_with_approximate_sync(self):
        self.start(approximate_sync='true', queue_size=100)
        for i in range(5):  # approximate: a pair comes out when later ones show that none fits better
            self.camera.publish(*self.camera.messages(i))
        self.until(lambda: len(self.info) >= 3)
        for seconds in (1, 2**31 - 1, 2**31, 2**32 - 1):
            images, infos = self.camera.messages(5)
            for publisher, message in zip(self.camera.infos + self.camera.images, infos + images):
                message.header.stamp = rospy.Time(seconds, 999999999)
                publisher.publish(message)
        # Topics keep their order: who answers a later pair has taken these.
        later, times = self.camera.messages(6)[0][0].header.stamp, itertools.count(6)

        def is_answered():
            i = next(times)
            self.camera.publish(*self.camera.messages(i % PAIRS, time_of=i))
            time.sleep(0.1)
            return self.info[-1].header.stamp >= later
        self.until(is_answered)
        self.assert_alive()

    def test_reset_service_goes_back_to_the_initial_pose(self):
        self.start(config=self.config('visual_odometry: {initial_pose: 10 5 0 0 0 1.5707963267948966}'))
        path = self.listen('path', Path)
        before = [self.feed(i) for i in range(3)][-1]
        self.call('visual_odometry/reset', Empty)
        after = self.feed(3)
        self.assertEqual((after.epoch, after.distance), (before.epoch + 1, 0.0))
        self.assertEqual(len(self.odometry), 4)
        start = [[0, -1, 0, 10], [1, 0, 0, 5], [0, 0, 1, 0], [0, 0, 0, 1]]  # looks along y
        for first in (self.odometry[0], self.odometry[3]):
            np.testing.assert_allclose(matrix_of(first.pose.pose), start, atol=1e-9)
        self.assertGreater(self.odometry[2].pose.pose.position.y, 5.5)
        self.until(lambda: path.has(after.header.stamp))
        self.assertEqual(len(path[-1].poses), 1)  # no line from the last place to the origin

    def test_reset_to_a_pose(self):
        self.start()
        before = self.feed(0)
        place = Pose()
        place.position.x, place.position.y = 10.0, 5.0
        self.assertFalse(self.call('visual_odometry/reset_to_pose', ResetToPose, place).success)  # a quaternion of zeros
        place.orientation.w = 1.0
        self.assertTrue(self.call('visual_odometry/reset_to_pose', ResetToPose, place).success)
        after = [self.feed(i) for i in range(1, 5)]
        self.assertEqual({info.epoch for info in after}, {before.epoch + 1})
        self.assertEqual(self.odometry[1].pose.pose, place)
        self.assertGreater(self.odometry[-1].pose.pose.position.x, 11.0)

    def test_set_pose(self):
        """By the service and by the topic: the base is there at the newest pair, the map stays, `epoch` counts it."""
        self.start()
        path = self.listen('path', Path)
        place = PoseWithCovarianceStamped()
        place.header.frame_id = 'odom'
        place.pose.pose.position.x, place.pose.pose.position.y = 10.0, 5.0
        q = place.pose.pose.orientation
        q.z = q.w = np.sqrt(0.5)  # looks along y
        place.pose.covariance = np.diag([0.04, 0.09, 0.01, 1e-4, 1e-4, 4e-4]).flatten().tolist()

        def refusal(**fields):
            wrong = copy.deepcopy(place)
            for name, value in fields.items():
                setattr(wrong.header if name == 'frame_id' else wrong.pose, name, value)
            answer = self.call('visual_odometry/set_pose', SetPose, wrong)
            self.assertFalse(answer.success)
            return answer.message
        self.assertIn('no pose yet', refusal())
        before = [self.feed(i) for i in range(3)][-1]
        step = self.odometry[2].pose.pose.position.x - self.odometry[1].pose.pose.position.x
        self.assertIn("'map'", refusal(frame_id='map'))
        self.assertIn('quaternion', refusal(pose=Pose()))
        self.assertIn('covariance', refusal(covariance=[float('nan')] * 36))
        self.assertEqual(self.feed(3).epoch, before.epoch, 'what is refused changes nothing')

        answer = self.call('visual_odometry/set_pose', SetPose, place)
        self.assertTrue(answer.success, answer.message)
        after = self.feed(4)
        self.assertEqual((after.state, after.epoch), ('TRACKING', before.epoch + 1))
        self.assertGreater(after.distance, before.distance)
        pose = matrix_of(self.odometry[-1].pose.pose)
        np.testing.assert_allclose(pose[:3, 3], [10.0, 5.0 + step, 0.0], atol=0.1)
        np.testing.assert_allclose(pose[:3, 0], [0.0, 1.0, 0.0], atol=0.01)
        # That of the pose, turned by a step's lever: sigma of the yaw is 20 mrad.
        covariance = np.array(self.odometry[-1].pose.covariance).reshape(6, 6)
        np.testing.assert_allclose(np.diag(covariance)[:3], [0.04 + 4e-4 * step**2, 0.09, 0.01 + 1e-4 * step**2], rtol=0.05)
        np.testing.assert_allclose(np.diag(covariance)[3:], [1e-4, 1e-4, 4e-4], rtol=0.05)

        publisher = self.publisher('visual_odometry/set_pose', PoseWithCovarianceStamped)
        place.pose.pose.position.x = -3.0
        publisher.publish(place)
        times = itertools.count(5)  # nothing orders it before a pair
        self.until(lambda: self.feed(4, time_of=next(times)).epoch == before.epoch + 2)
        self.assertAlmostEqual(self.odometry[-1].pose.pose.position.x, -3.0, delta=0.1)
        self.until(lambda: path.has(self.info[-1].header.stamp))

        # While it is lost the next pair begins there.
        while self.info[-1].state != 'LOST':
            images, infos = self.camera.dark(4, time_of=next(times))
            self.feed_messages(images, infos)
        place.pose.pose.position.x = 70.0
        self.assertTrue(self.call('visual_odometry/set_pose', SetPose, place).success)
        after = self.feed(8, time_of=next(times))
        self.assertEqual(after.epoch, before.epoch + 3)
        self.assertAlmostEqual(self.odometry[-1].pose.pose.position.x, 70.0, delta=1e-6)
        self.assert_alive()

    def test_pause_and_resume(self):
        self.start()
        self.features.close()
        before = [self.feed_alone(i) for i in range(3)]
        self.assertTrue(self.call('visual_odometry/pause', Trigger).success)
        self.assertTrue(self.call('visual_odometry/pause', Trigger).success)
        self.until(lambda: not self.camera.has_subscribers())  # the image side rests too
        self.camera.publish(*self.camera.messages(3))
        self.until(lambda: self.diagnosis().message == 'paused')
        self.assertTrue(self.call('visual_odometry/resume', Trigger).success)
        self.until(lambda: self.camera.is_subscribed() and self.pipeline.is_connected(()))
        after = [self.feed_alone(i) for i in range(4, 7)]
        self.assertEqual([info.state for info in after], ['TRACKING'] * 3)
        self.assertIn('re-acquired', after[0].reason)
        self.assertEqual({info.epoch for info in after}, {before[-1].epoch})
        self.assertEqual(list(self.info), before + after)

    def feed_alone(self, i):
        """As feed(), where nobody but the odometry listens to the features."""
        self.until(lambda: self.is_answered(i))
        return self.info[-1]

    def test_save_trajectory(self):
        self.start()
        directory = self.folder()
        path = os.path.join(directory, 'poses.txt')
        self.assertFalse(self.call('visual_odometry/save_trajectory', SaveTrajectory, path, 'tum').success)  # nothing yet
        for i in range(4):
            self.feed(i)
        answer = self.call('visual_odometry/save_trajectory', SaveTrajectory, path, 'tum')
        self.assertEqual((answer.success, answer.message), (True, "4 poses in '%s'" % path))
        rows = np.loadtxt(path)
        np.testing.assert_allclose(rows[:, 0], [m.header.stamp.to_sec() for m in self.odometry])
        np.testing.assert_allclose(rows[:, 1], [m.pose.pose.position.x for m in self.odometry], atol=1e-9)
        others = os.path.join(directory, 'others.txt')
        with open(others, 'w') as file:
            file.write('precious')
        answer = self.call('visual_odometry/save_trajectory', SaveTrajectory, others, 'tum')
        self.assertFalse(answer.success)
        self.assertIn(others + "' was there before", answer.message)
        self.assertEqual(os.path.getsize(others), 8)
        self.assert_alive()

    def test_reconfiguring_takes_effect_and_is_clamped_or_refused(self):
        self.start()
        before = self.feed(0)
        self.assertGreater(before.detected, 400)
        client = self.reconfigure('stereo_features')
        # What does not go together.
        wrong = ({'size_curve/min_size': 100.0}, {'descriptor/type': 'surf'}, {'detector/type': 'no such detector'})
        for i, request in enumerate(wrong):
            answer = client.update_configuration(dict(request, **{'detector/max_features': 300}))
            for name, value in request.items():
                self.assertNotEqual(answer[name], value)
            self.assertNotEqual(answer['detector/max_features'], 300)
            self.until(lambda: sum('nothing reconfigured' in w for w in self.rosout.warnings) == i + 1)
            self.assertGreater(self.feed(i + 1).detected, 400)
        # What comes next and is right takes effect.
        answer = client.update_configuration({'detector/max_features': 200, 'stereo/max_epipolar_residual': 1000.0})
        self.assertEqual(answer['detector/max_features'], 200)
        self.assertEqual(answer['stereo/max_epipolar_residual'], 4.0)  # the end of its range
        client.update_configuration({'stereo/max_epipolar_residual': 1.5})
        after = self.feed(4)
        self.assertEqual(after.detected, 200)
        # Fewer features are described as before: nothing begins anew. Nor with the same value.
        self.assertEqual((after.state, after.epoch), ('TRACKING', before.epoch))
        client.update_configuration({'size_curve/max_size': 32.0})
        after = self.feed(5)
        self.assertEqual((after.state, after.epoch), ('TRACKING', before.epoch))
        # Rows of another size do not continue the old ones, but the map is found again by them.
        client.update_configuration({'size_curve/max_size': 25.0})
        after = self.feed(6)
        self.assertEqual((after.state, after.epoch), ('TRACKING', before.epoch))
        self.assertIn('re-acquired', after.reason)
        self.assertEqual(self.feed(7).state, 'TRACKING')
        self.assertEqual(self.rosout.errors, [])
        # The odometry's, with the next pair.
        self.reconfigure('visual_odometry').update_configuration({'tracking/max_speed': 1.0})
        info = self.feed(8)  # 10 m/s
        self.assertNotEqual(info.state, 'TRACKING')
        self.assertIn('exceeds tracking/max_speed', info.reason)
        self.assert_alive()

    def test_rounding_of_the_calibration_is_no_new_one(self):
        self.start()
        for i in range(PAIRS - 1):
            images, infos = self.camera.messages(i)
            for info in infos:
                p = list(info.P)
                p[0] += 1e-9 * i
                p[2] += 1e-9 * i
                info.P = p
            info = self.feed_messages(images, infos)
            self.assertEqual((info.state, info.epoch), ('TRACKING', self.info[0].epoch))
        self.assertEqual({features.stream_epoch for features in self.features}, {self.features[0].stream_epoch})
        images, infos = self.camera.messages(PAIRS - 1)
        for info in infos:
            info.P = [1.1 * p if k < 8 else p for k, p in enumerate(info.P)]
        self.assertEqual(self.feed_messages(images, infos).epoch, self.info[0].epoch + 1)
        # A baseline in mm is named as check_camera does, with each new stream.
        self.assertFalse(self.rosout.warned('calibration: '), self.rosout.warnings)
        images, infos = self.camera.messages(PAIRS - 1, time_of=PAIRS)
        infos[1].P = [1000 * p if k == 3 else p for k, p in enumerate(infos[1].P)]
        self.feed_messages(images, infos)
        self.until(lambda: self.rosout.warned('calibration: ', 'in pixels times mm or cm'))

    def test_another_odometry_tells_of_a_motion_that_was_not_to_be_expected(self):
        self.start(config=self.config('visual_odometry: {guess_frame_id: wheels, guess_timeout: 0.5}\n'))
        for i in range(4):
            self.feed(i)
        self.until(lambda: self.rosout.warned('no guess of the motion'))

        # From one pair to the next as far as in six. Nothing orders TF and images: the pair waits for it, once the rest after a
        # missing guess is over.
        time.sleep(1.0)
        tf = self.tf_broadcaster()
        before, last = self.odometry[-2].pose.pose.position, self.odometry[-1].pose.pose.position
        step = np.hypot(last.x - before.x, last.y - before.y)
        images, infos = self.camera.messages(9, time_of=4)
        for stamp, x in ((self.info[-1].header.stamp, 20.0), (images[0].header.stamp, 20.0 + 6.0 * step)):
            transform = planar_transform('wheels', 'base_link', stamp, x)
            tf.sendTransform(transform)
        info = self.feed_messages(images, infos)
        self.assertEqual(info.state, 'TRACKING', info.reason)
        now = self.odometry[-1].pose.pose.position
        self.assertAlmostEqual(np.hypot(now.x - last.x, now.y - last.y), 6.0 * step, delta=0.5)
        # TF has odom -> wheels, in which the wheels carry the base. It stays in the dark.
        all_tf = self.keep(Collector('/tf', TFMessage))
        self.until(lambda: ('out', '/tf', rospy.get_name()) in links(self.pipeline.manager))
        times = itertools.count(5)
        self.until(lambda: self.feed_messages(*self.camera.dark(9, time_of=next(times))).state == 'LOST')
        self.until(lambda: any(t.header.stamp == self.info[-1].header.stamp for t in transforms_to('wheels', all_tf)))
        correction = transforms_to('wheels', all_tf)[-1]
        self.assertEqual(correction.header.frame_id, 'odom')
        T_odom_base = matrix_of(correction.transform) @ matrix_of(transform.transform)
        np.testing.assert_allclose(T_odom_base[:3, 3], [now.x, now.y, self.odometry[3].pose.pose.position.z], atol=1.0)

    def test_the_truth_on_tf_is_where_it_starts_and_what_errors_are_of(self):
        self.start(config=self.config('visual_odometry: {ground_truth_frame_id: world, ground_truth_base_frame_id: marker}\n'))
        errors = self.listen('ground_truth_error', PoseStamped)
        times = itertools.count()
        info = self.feed_messages(*self.camera.messages(0, time_of=next(times)))
        self.assertEqual(info.state, 'WAITING')
        self.assertIn('ground_truth_frame_id', info.reason)
        tf = self.tf_broadcaster()
        for stamp in (info.header.stamp, info.header.stamp + rospy.Duration(9)):
            marker = planar_transform('world', 'marker', stamp, 10.0, 5.0, np.pi / 2)
            tf.sendTransform(marker)
        self.until(lambda: self.feed_messages(*self.camera.messages(0, time_of=next(times))).state != 'WAITING')
        np.testing.assert_allclose(matrix_of(self.odometry[0].pose.pose), matrix_of(marker.transform), atol=1e-9)
        for i in (1, 2):
            self.feed_messages(*self.camera.messages(i, time_of=next(times)))
        self.until(lambda: errors.has(self.odometry[-1].header.stamp))
        np.testing.assert_allclose(matrix_of(errors[0].pose), np.eye(4), atol=1e-9)
        driven = self.odometry[-1].pose.pose.position
        self.assertGreater(driven.y, 5.5)
        self.assertAlmostEqual(errors[-1].pose.position.x, driven.y - 5.0, delta=1e-6)  # as if the base stood

    def test_nothing_works_while_the_wheels_stand(self):
        self.clock.jump_to(rospy.Time.from_sec(EPOCH))  # tests before carried it on, and a guess must not be old
        self.start(config=self.config('visual_odometry: {guess_frame_id: wheels, guess_timeout: 0.5, guess_min_translation: 0.1}\n'))
        all_tf = self.keep(Collector('/tf', TFMessage))
        tf = self.tf_broadcaster()
        self.until(lambda: ('out', '/tf', rospy.get_name()) in links(self.pipeline.manager))
        driven, times = [0.0], itertools.count()

        def images(i, step=0.0):
            """Pair i at the next stamp, and where the wheels are by then."""
            messages = self.camera.messages(i, time_of=next(times))
            driven[0] += step
            tf.sendTransform(planar_transform('wheels', 'base_link', messages[0][0].header.stamp, driven[0]))
            return messages

        def cpu():
            with open('/proc/%d/stat' % self.pid) as file:
                return sum(int(word) for word in file.read().rsplit(')')[1].split()[11:13]) / os.sysconf('SC_CLK_TCK')
        before = cpu()
        for i in range(4):
            info = self.feed_messages(*images(i, 1.0))
            self.assertEqual(info.state, 'TRACKING')
        working = (cpu() - before) / 4
        self.features.close()  # the only other listener
        self.closeables.remove(self.features)

        def rests():
            self.camera.publish(*images(3))
            time.sleep(0.1)
            return not self.camera.has_subscribers()
        self.until(rests)
        answers, before = len(self.info), cpu()
        for _ in range(200):  # longer than TF remembers
            self.camera.publish(*images(3))
            time.sleep(0.02)
        self.assertLess((cpu() - before) / 200, 0.2 * working)  # of a pair
        self.assertEqual(len(self.info), answers)
        self.until(lambda: 'the base stands, by wheels' in self.diagnosis('input rate').message)
        self.assertGreater(transforms_to('wheels', all_tf)[-1].header.stamp, info.header.stamp + rospy.Duration(10))

        # Off it goes: the map is where it was.
        self.until(lambda: images(4, 1.0) and self.camera.is_subscribed())
        before = self.odometry[-1].pose.pose.position
        driven[0] = 5.0
        messages = images(4)
        self.camera.publish(*messages)
        self.until(lambda: self.odometry.has(messages[0][0].header.stamp) and len(self.info) > answers)
        self.assertEqual((self.info[-1].state, self.info[-1].epoch), ('TRACKING', 0), self.info[-1].reason)
        after = self.odometry[-1].pose.pose.position
        self.assertAlmostEqual(np.hypot(after.x - before.x, after.y - before.y), 1.0, delta=0.1)

    def test_a_gyro_is_asked_for_the_rotation(self):
        self.start(config=self.config('visual_odometry: {use_imu: true, guess_timeout: 1.0}\n'))
        imu = self.publisher('imu', Imu)

        def measure(stamp, duration, rate):
            """What the IMU measures up to `stamp`, without a gap: it stands on its head and turns a little."""
            for k in range(round(duration / 0.01)):
                message = Imu()
                message.header.frame_id = 'gyro'
                message.header.stamp = stamp - rospy.Duration.from_sec(duration) + rospy.Duration.from_sec(0.01 * (k + 1))
                message.angular_velocity.z, message.linear_acceleration.z = rate, 9.81
                imu.publish(message)

        times = itertools.count(1)

        def feed(i, rate):
            images, infos = self.camera.messages(i, time_of=next(times))
            measure(images[0].header.stamp, 0.1, rate)
            return self.feed_messages(images, infos)
        # A robot that stands tells gravity; nothing begins before that is here.
        measure(self.camera.messages(0, time_of=0)[0][0].header.stamp, 1.5, 0.0)
        self.until(lambda: feed(0, 0.0).state == 'TRACKING')
        self.assertEqual(feed(1, 0.02).state, 'TRACKING')
        self.until(lambda: self.rosout.warned('no guess of the motion', 'gyro'))

        transform = camera_transform('gyro')
        q = transform.transform.rotation
        q.x, q.y, q.z, q.w = 1.0, 0.0, 0.0, 0.0
        self.broadcaster.sendTransform([camera_transform(FRAME), transform])  # what is latched replaces what was
        for i in range(2, 6):
            self.assertEqual(feed(i, 0.02).state, 'TRACKING')
        for rate in (float('nan'), 1e300):
            measure(self.info[-1].header.stamp + rospy.Duration.from_sec(0.005), 0.01, rate)
        self.until(lambda: self.rosout.warned('a message of the IMU is not used', 'rad/s'))
        self.assertEqual(feed(6, 0.02).state, 'TRACKING')

    def test_an_accelerometer_levels_after_a_reset_and_is_no_gyro(self):
        self.start(config=self.config('visual_odometry: {use_imu: true}\n'))
        imu = self.publisher('imu', Imu)
        self.assertIn('no acceleration has come', self.feed(0).reason)
        self.call('visual_odometry/reset', Empty)
        tilt = np.radians(10.0)
        still = Imu()
        still.header.frame_id = 'base_link'
        still.linear_acceleration.x, still.linear_acceleration.z = 9.81 * np.sin(tilt), 9.81 * np.cos(tilt)
        still.angular_velocity_covariance[0] = -1.0
        for k in range(90):
            still.header.stamp = self.camera.messages(0)[0][0].header.stamp - rospy.Duration.from_sec(0.015 * (90 - k))
            imu.publish(still)
        times = itertools.count(1)
        self.until(lambda: self.feed(0, time_of=next(times)).state == 'TRACKING')
        up = matrix_of(self.odometry[-1].pose.pose)[:3, :3] @ [np.sin(tilt), 0.0, np.cos(tilt)]
        self.assertAlmostEqual(up[2], 1.0, delta=1e-3)
        for i in range(1, 4):
            self.assertEqual(self.feed(i, time_of=next(times)).state, 'TRACKING')
        self.until(lambda: self.rosout.warned('measures no rates'))
        self.assertFalse(self.rosout.warned('no guess of the motion'), self.rosout.warnings)

    def test_a_camera_that_is_the_base_needs_no_transform(self):
        """A camera in the hand: odom has x ahead and z up, the base the axes of its images."""
        frame = self.namespace[1:] + '_optical'
        self.start(base_frame_id=frame)
        for i in range(4):
            self.assertEqual(self.feed(i, frame=frame).state, 'TRACKING')
        first, last = (matrix_of(self.odometry[i].pose.pose) for i in (0, -1))
        np.testing.assert_allclose(first[:3, :3], [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=1e-9)
        self.assertGreater(last[0, 3], 3.0 * max(abs(last[1, 3]), abs(last[2, 3])))
        self.assertEqual((self.rosout.errors, self.rosout.warnings), ([], []))

    def test_another_image_frame_goes_on_from_the_last_pose_of_the_base(self):
        side = camera_transform('side')
        side.transform.translation.x = 0.7
        q = side.transform.rotation
        q.x, q.y, q.z, q.w = 0.0, np.sqrt(0.5), -np.sqrt(0.5), 0.0  # looks to the right
        self.broadcaster.sendTransform([camera_transform(FRAME), side])
        self.start()
        for i in range(5):
            self.feed(i)
        before, there = self.info[-1], matrix_of(self.odometry[-1].pose.pose)
        after = self.feed(5, frame='side')
        self.assertEqual((after.state, after.epoch), ('DEGRADED', before.epoch + 1))
        np.testing.assert_allclose(matrix_of(self.odometry[-1].pose.pose), there, atol=1e-6)
        self.until(lambda: self.rosout.warned(FRAME, "is 'side' now"))
        self.assertEqual(self.feed(6, frame='side').epoch, after.epoch)
        moved = np.linalg.inv(there) @ matrix_of(self.odometry[-1].pose.pose)
        self.assertLess(moved[1, 3], -0.1)
        self.assertLess(abs(moved[0, 3]), 0.2 * abs(moved[1, 3]))

    def test_a_mount_that_changes_is_said_once(self):
        self.addCleanup(self.broadcaster.sendTransform, camera_transform(FRAME))
        self.start()
        for i in range(3):
            self.feed(i)
        moved = camera_transform(FRAME)
        moved.transform.translation.z = 0.25
        self.broadcaster.sendTransform(moved)
        times = itertools.count(3)
        self.until(lambda: self.feed(3, time_of=next(times)) and
                   self.rosout.warned('has changed by 0.250 m and 0.000 deg', 'call reset'))
        for i in range(4, 7):
            self.feed(i, time_of=next(times))
        self.assertEqual(sum('has changed by' in warning for warning in self.rosout.warnings), 1)
        self.assertEqual(self.info[-1].epoch, 0)

    def test_another_publisher_of_the_same_transform_is_named(self):
        self.start()
        self.feed(0)
        tf = self.tf_broadcaster()
        transform = planar_transform('odom', 'base_link', self.info[0].header.stamp)

        def is_named():
            tf.sendTransform(transform)
            return self.rosout.warned(rospy.get_name() + ' publishes odom -> base_link',
                                      self.pipeline.manager + ' publishes odom -> base_link')
        self.until(is_named)

    def test_overload_drops_whole_pairs_and_keeps_the_newest(self):
        self.sequence = self.sequence.scaled(2.0)
        self.start()
        last = PAIRS - 1
        # All pairs at once, each of which takes its time; stamps as of a fast camera, whose gaps are no jumps.
        for i in range(PAIRS):
            self.camera.publish(*self.camera.messages(i, time_of=0.1 * i))
        stamp = self.camera.messages(last, time_of=0.1 * last)[0][0].header.stamp
        self.until(lambda: len(self.info) > 0 and self.info[-1].header.stamp == stamp)
        info = self.info[-1]
        self.assertEqual(len(self.info) + info.dropped_pairs + info.dropped_features, PAIRS)
        self.assertGreater(info.dropped_pairs, 0)

    def test_queues_as_long_as_a_recording_keep_every_pair(self):
        self.start(queue_size=100)
        for i in range(PAIRS):
            self.camera.publish(*self.camera.messages(i))
        self.until(lambda: len(self.info) == PAIRS)

    def test_loading_and_unloading_while_messages_come(self):
        self.start()
        unload = rospy.ServiceProxy(self.pipeline.manager + '/unload_nodelet', NodeletUnload)
        nodelets = (('stereo_features', 'StereoFeatures'), ('visual_odometry', 'VisualOdometry'),
                    ('features_image', 'FeaturesImage'))
        self.collect('features_image', Image)
        running = True

        def publish():
            i = 0
            while running:
                self.camera.publish(*self.camera.messages(i % PAIRS, time_of=i))
                i += 1
                time.sleep(0.03)
        thread = threading.Thread(target=publish)
        thread.start()
        try:
            for _ in range(8):
                for name, type_name in nodelets:
                    self.assertTrue(unload('%s/%s' % (self.namespace, name)).success)
                    self.assertTrue(load_nodelet(self.pipeline.manager, '%s/%s' % (self.namespace, name), PACKAGE + '/' + type_name))
                    self.assert_alive()
        finally:
            running = False
            thread.join()
        # A pair whose answer goes out before we are connected again is not answered a second time: each try has its own.
        times = itertools.count(10000)
        self.until(lambda: self.is_answered(0, time_of=next(times)))
        self.assert_alive()

    def test_wrong_parameters_are_named_and_the_nodelet_is_not_loaded(self):
        self.start()
        for type_name, name, value in (('StereoFeatures', 'detector/max_features', -1),
                                       ('VisualOdometry', 'initial_pose', 'here'),
                                       ('VisualOdometry', 'odom_frame_id', '/base_link'), ('VisualOdometry', 'base_frame_id', ''),
                                       ('VisualOdometry', 'guess_frame_id', 'odom'), ('VisualOdometry', 'ground_truth_frame_id', 'world'),
                                       ('PlaceRecognition', 'map_frame_id', '/'),
                                       ('PlaceRecognition', 'sync_queue_size', 'many')):
            nodelet = '%s/wrong_%s_%s' % (self.namespace, type_name, name.replace('/', '_'))
            rospy.set_param(nodelet + '/' + name, value)
            with self.assertRaises(rospy.ServiceException):  # so nodelet says that it did not load
                load_nodelet(self.pipeline.manager, nodelet, PACKAGE + '/' + type_name)
            self.until(lambda: self.rosout.said('not started', str(value) if name == 'initial_pose' else name))
        self.assertEqual(self.feed(0).state, 'TRACKING')
        self.assert_alive()

    def test_features_image_is_drawn_while_someone_looks(self):
        self.start()
        self.feed(0)
        picture = self.collect('features_image', Image)
        flow = self.collect('feature_flow', FeatureFlow)

        def is_looking():  # nobody else in the manager listens to the flow
            return ('in', self.namespace + '/feature_flow') in links(self.pipeline.manager)
        self.until(lambda: is_looking() and self.pipeline.is_connected((picture, flow)))
        self.feed(1)
        self.until(lambda: len(picture) == 1 and len(flow) == 1)
        self.assertEqual(picture[0].header.stamp, self.info[-1].header.stamp)
        self.assertEqual(flow[0].header.stamp, self.info[-1].header.stamp)
        height, width = self.sequence.pairs[0][0].shape
        self.assertEqual((picture[0].height, picture[0].width, picture[0].encoding), (2 * height, width, 'bgr8'))
        self.assertTrue(any(flow[0].inlier))
        picture.close()
        self.until(lambda: not is_looking())

    def test_mask(self):
        height, width = self.sequence.pairs[0][0].shape
        right, left = np.zeros((2, height, width), np.uint8)
        right[:, width // 2:] = left[:, :width // 2] = 255
        file = tempfile.NamedTemporaryFile(suffix='.png')
        self.addCleanup(file.close)
        cv2.imwrite(file.name, right)
        self.start(config=self.config('stereo_features: {detector: {mask: %s}}' % file.name))
        self.assertGreater(self.feed(0).features, 100)
        self.assertGreater(min(self.features[-1].u), width // 2 - 2)
        publisher = self.publisher('left/mask', Image)
        times = itertools.count(1)

        def is_used(mask, used):
            """Whether it is in use by the time a pair is answered: nothing orders masks and images."""
            publisher.publish(self.camera.bridge.cv2_to_imgmsg(mask, 'mono8'))
            self.camera.publish(*self.camera.messages(1, time_of=next(times)))
            return wait_until(used, 0.5)
        self.until(lambda: is_used(left, lambda: max(self.features[-1].u) < width // 2 + 2))
        self.until(lambda: is_used(left[1:], lambda: self.rosout.said(
            'skipped', 'the mask is %dx%d, the left image is %dx%d' % (width, height - 1, width, height))))
        self.until(lambda: is_used(right, lambda: min(self.features[-1].u) > width // 2 - 2))
        publisher.unregister()
        self.assert_alive()

    def test_late_input_is_dropped_and_counted(self):
        self.start()
        for i in range(3):
            self.feed(i)
        self.camera.publish(*self.camera.messages(1))
        info = self.feed(3)
        self.assertEqual((len(self.info), info.dropped_pairs, info.out_of_order), (4, 1, 0))

        publisher = self.publisher('stereo_features', StereoFeatures)
        publisher.publish(self.features[1])
        for i in range(4, PAIRS):  # two publishers: nothing orders it before the next pair
            info = self.feed(i)
            if info.out_of_order > 0:
                break
        self.assertEqual((len(self.info), info.dropped_pairs, info.out_of_order), (i + 1, 1, 1))
        self.assertEqual((info.state, info.epoch), ('TRACKING', self.info[0].epoch))
        publisher.unregister()

    def test_rows_that_do_not_agree_are_named_once(self):
        self.start()
        for i in range(3):
            self.assertEqual(self.feed(i).state, 'TRACKING')
        for i in range(3, 7):
            images, infos = self.camera.messages(i)
            images[1].data = self.camera.bridge.cv2_to_imgmsg(np.roll(self.sequence.pairs[i][1], 5, axis=0)).data
            info = self.feed_messages(images, infos)
            if i == 3:
                self.assertIn('the right camera seems to have turned', info.reason)
        self.until(lambda: self.rosout.warned('pairs from'))
        named = [warning for warning in self.rosout.warnings if 'pairs from' in warning]
        self.assertEqual(len(named), 1, self.rosout.warnings)
        self.assertIn('are matched along their rows: right image', named[0])
        self.assertIn('too low: not rectified?', named[0])
        # Said once in five seconds, whatever the rows do meanwhile.
        times = itertools.count(7)
        self.until(lambda: self.feed(7, time_of=next(times)) and self.rosout.warned('rows of left and right agree again'))
        self.assert_alive()

    def start_another(self, sequence):
        """A second pipeline in the same manager; its camera and what it says."""
        namespace = self.namespace + '_other'
        info = self.keep(Collector(namespace + '/vo_info', VoInfo))
        odometry = self.keep(Collector(namespace + '/odom', Odometry))
        features = self.keep(Collector(namespace + '/stereo_features', StereoFeatures))
        camera = self.keep(Camera(namespace, sequence, self.clock))
        other = self.keep(Pipeline(namespace, start_manager='false', manager=self.pipeline.manager))
        self.until(lambda: camera.is_subscribed() and other.is_connected((info, odometry, features)), 60)
        return camera, info, odometry, features

    def test_two_cameras_in_one_manager(self):
        self.start()
        other_camera, other_info, other_odometry, other_features = self.start_another(self.sequence.scaled(0.75))
        for i in range(6):
            other_camera.publish(*other_camera.messages(i))
            self.feed(i)
            self.until(lambda: len(other_info) == i + 1 and len(other_odometry) == i + 1)
        for info, features, scale in ((self.info, self.features, 1.0), (other_info, other_features, 0.75)):
            self.assertEqual([(m.state, m.epoch) for m in info], [('TRACKING', info[0].epoch)] * 6)
            self.until(lambda: len(features) == 6)
            self.assertEqual({m.stream_epoch for m in features}, {features[0].stream_epoch})
            self.assertAlmostEqual(features[-1].fx, scale * self.sequence.projections[0][0])
            self.assertEqual(features[-1].image_height, round(scale * self.sequence.pairs[0][0].shape[0]))
        # Both saw the same way.
        self.assertGreater(self.info[-1].distance, 4.0)
        self.assertAlmostEqual(other_info[-1].distance, self.info[-1].distance, delta=0.05 * self.info[-1].distance)
        # They share nothing but one transform.
        self.assert_only(self.info)
        self.until(lambda: self.rosout.warned('another nodelet of', 'publishes odom -> base_link'))

    def start_manager_of_others(self):
        """A manager with two threads, and two nodelets of others in it that each keep one."""
        directory = self.folder()
        with open(os.path.join(directory, 'package.xml'), 'w') as file:
            file.write('<package format="2"><name>slow_nodelets</name><version>0.0.0</version><description>slow</description>'
                       '<maintainer email="a@b.org">a</maintainer><license>BSD</license><depend>nodelet</depend>'
                       '<export><nodelet plugin="${prefix}/plugins.xml"/></export></package>')
        with open(os.path.join(directory, 'plugins.xml'), 'w') as file:
            file.write('<library path="lib%s_slow_nodelet"><class name="slow_nodelets/Slow" '
                       'type="slow_nodelets::SlowNodelet" base_class_type="nodelet::Nodelet"/></library>' % PACKAGE)
        manager = self.namespace + '/manager_of_others'
        rospy.set_param(manager + '/num_worker_threads', 2)
        with mock.patch.dict(os.environ, ROS_PACKAGE_PATH=directory + ':' + os.environ['ROS_PACKAGE_PATH']):
            ended_by(self, nodelet_process('manager', '__ns:=' + self.namespace, '__name:=manager_of_others'))
        for name in ('slow_1', 'slow_2'):
            self.assertTrue(load_nodelet(manager, '%s/%s' % (self.namespace, name), 'slow_nodelets/Slow'))
            self.addCleanup(rospy.set_param, '%s/%s/released' % (self.namespace, name), True)
        return manager

    def test_slow_nodelets_of_others_do_not_slow_ours(self):
        manager = self.start_manager_of_others()
        driver = self.keep(Camera(self.namespace, self.sequence, self.clock))

        def are_busy():
            return all(rospy.get_param('%s/slow_%d/busy' % (self.namespace, k), False) for k in (1, 2))
        self.until(lambda: driver.publish(*driver.messages(0)) or are_busy())
        places = self.collect('place_info', PlaceInfo)
        picture = self.collect('features_image', Image)
        self.start(manager=manager, start_manager='false', loop_closing='true')
        self.until(lambda: self.pipeline.is_connected((places, picture)) and
                   ('in', self.namespace + '/feature_flow') in links(manager))
        for i in range(1, 5):
            self.assertEqual(self.feed(i).state, 'TRACKING')
        self.assertEqual(self.info[-1].dropped_pairs, 0)
        self.until(lambda: len(places) > 0 and len(picture) > 0)
        self.call('visual_odometry/reset', Empty)
        self.assertEqual(self.feed(5).epoch, self.info[0].epoch + 1)
        self.assertTrue(are_busy())
        self.assert_alive()


if __name__ == '__main__':
    rospy.init_node('live_test')
    rostest.rosrun(PACKAGE, 'live', Live, sys.argv)
