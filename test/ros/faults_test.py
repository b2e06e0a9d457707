#!/usr/bin/env python3
"""What operators meet, without a data set: a camera that moves past made-up walls, with a clock of its own beside the system's."""

import copy
import itertools
import os
import socket
import subprocess
import sys
import threading
import time
from unittest import mock

import dynamic_reconfigure.client
import numpy as np
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from nodelet.srv import NodeletUnload
from sensor_msgs.msg import Image, PointCloud2
from std_srvs.srv import Empty, Trigger
from tf2_msgs.msg import TFMessage

from kitti_replay import (EPOCH, FRAME, PACKAGE, Camera, Collector, Pipeline, Rosout, links, load_nodelet, matrix_of,
                          transforms_to, wait_until)
from made_up_sequence import STEP, MadeUpSequence
from pipeline_case import SILENCE, PipelineCase, camera_transform
from stereo_descriptor_vo.msg import MapGraph, PlaceInfo, StereoFeatures, VoInfo
from stereo_descriptor_vo.srv import SavePlaces, SaveTrajectory

PAIRS = 40


class Faults(PipelineCase):
    begin = 0  # of the diagnostics looked at

    @classmethod
    def setUpClass(cls):
        super().setUpClass(MadeUpSequence(PAIRS))

    def position(self, k=-1):
        return matrix_of(self.odometry[k].pose.pose)[:3, 3]

    def test_a_driver_that_restarts_keeps_pose_and_places(self):
        """Its stamps begin again near zero while the system's clock goes on, and a map is loaded."""
        file = os.path.join(self.folder(), 'map.bag')
        config = self.config('place_recognition: {keyframe_distance: 0.1}\n')
        self.start(config=config, loop_closing='true', queue_size=5)
        places = self.listen('place_info', PlaceInfo)
        for i in range(30):
            self.feed(i)
        self.until(lambda: len(places) >= 5)
        self.assertTrue(self.call('place_recognition/save_places', SavePlaces, file).success)
        self.tearDown()
        self.setUp()

        self.start(config=config, loop_closing='true', places_file=file, queue_size=5)
        places = self.listen('place_info', PlaceInfo)
        for i in range(20):
            self.assertEqual(self.feed(i).state, 'TRACKING')
        self.until(lambda: len(places) >= 3)
        known, epoch, answered, last = places[-1].places, self.info[-1].epoch, len(self.info), self.position()
        self.assertGreater(known, 5)
        self.assertGreater(np.linalg.norm(last), 15 * STEP)

        # The first pair of another time waits for the second one to confirm it.
        boot = -10 * EPOCH + 2.0  # in tenths of a second
        self.camera.publish(*self.camera.messages(20, time_of=boot))
        self.camera.publish(*self.camera.messages(21, time_of=boot + 1))
        self.until(lambda: len(self.info) == answered + 2)
        for i in range(22, 30):
            self.feed(i, time_of=boot + i - 20)
        self.assertEqual({info.epoch for info in self.info[answered:]}, {epoch})
        self.assertLess(self.info[-1].header.stamp, rospy.Time(10))
        self.until(lambda: len(self.odometry) == answered + 10)
        self.assertAlmostEqual(np.linalg.norm(self.position(answered) - last), STEP, delta=0.2 * STEP)
        self.assertAlmostEqual(np.linalg.norm(self.position() - self.position(answered)), 9 * STEP, delta=STEP)
        self.until(lambda: len(places) > 0 and places[-1].header.stamp < rospy.Time(10))
        self.assertGreater(places[-1].places, known)
        self.assertEqual([w for w in self.rosout.warnings if 'forgotten' in w or 'starts again' in w], [])
        self.assertEqual(self.rosout.errors, [])
        self.assert_alive()

    def busy_disk(self):
        """(library, file): who preloads the library waits in fsync() as long as the file is there."""
        library, file = (os.path.join(self.folder(), name) for name in ('busy_disk.so', 'busy'))
        subprocess.run(['cc', '-shared', '-fPIC', '-x', 'c', '-', '-o', library], check=True, universal_newlines=True,
                       input='#include <unistd.h>\nint fsync(int f) { while (!access("%s", F_OK)) usleep(1000); return 0 * f; }\n' % file)
        open(file, 'w').close()
        return library, file

    def test_a_slow_disk_does_not_hold_pairs_up(self):
        library, busy = self.busy_disk()
        with mock.patch.dict(os.environ, LD_PRELOAD=library):
            self.start()
        for i in range(3):
            self.feed(i)
        path = os.path.join(self.folder(), 'poses.txt')
        answers = []
        writer = threading.Thread(target=lambda: answers.append(
            self.call('visual_odometry/save_trajectory', SaveTrajectory, path, 'tum')), daemon=True)
        writer.start()
        try:
            for i in range(3, 20):
                self.assertEqual(self.feed(i).state, 'TRACKING')
            self.assertEqual(answers, [])
            self.assertFalse(os.path.exists(path))
        finally:
            os.remove(busy)
            writer.join(10)
        self.assertTrue(answers[0].success)
        with open(path) as file:
            self.assertIn(len(file.readlines()), range(3, 20), 'no pair was answered while the file waited')

    def test_a_pair_that_throws_is_answered(self):
        """Memory for the descriptors of one message cannot be had; OpenCV throws in the midst of that pair."""
        rows, row = 333, 128
        library = os.path.join(self.folder(), 'full_memory.so')
        subprocess.run(['cc', '-shared', '-fPIC', '-x', 'c', '-', '-o', library], check=True, universal_newlines=True,
                       input='#include <errno.h>\n#include <malloc.h>\nint posix_memalign(void** p, size_t alignment, size_t size) {\n'
                       'if (size == %d) return ENOMEM; *p = memalign(alignment, size); return *p ? 0 : ENOMEM; }\n' % (rows * row))
        with mock.patch.dict(os.environ, LD_PRELOAD=library, OPENCV_ENABLE_MEMALIGN='1'):
            self.start()
        for i in range(3):
            self.assertEqual(self.feed(i).state, 'TRACKING')
        publisher = self.publisher('stereo_features', StereoFeatures)
        message = copy.deepcopy(self.features[2])
        message.header.stamp += rospy.Duration.from_sec(0.05)
        for name in ('u', 'v', 'disparity', 'dv', 'size', 'angle', 'response'):
            setattr(message, name, getattr(message, name)[:rows])
        message.descriptors, message.patches = message.descriptors[:rows * row], message.patches[:rows * message.patch_side**2]
        self.assertEqual(len(message.descriptors), rows * row)
        publisher.publish(message)
        self.until(lambda: self.info.has(message.header.stamp))
        answer = self.info[-1]
        self.assertEqual((answer.state, answer.epoch), ('WAITING', self.info[0].epoch))
        self.assertIn('features skipped', answer.reason)
        self.until(lambda: self.rosout.said('skipped', 'Failed to allocate'))
        self.assertIn('visual_odometry_nodelet.cpp', self.rosout.files)  # of the caller
        after = self.feed(3)
        self.assertEqual((after.state, after.epoch), ('TRACKING', answer.epoch))
        self.assert_alive()

    def test_approximate_pairs_are_not_one_frame_late(self):
        self.start(approximate_sync='true')
        for i in range(4):
            images, infos = self.camera.messages(i)
            for message in (images[1], infos[1]):
                message.header.stamp += rospy.Duration.from_sec(0.002)
            self.assertEqual(self.feed_messages(images, infos).state, 'TRACKING')
        self.assertAlmostEqual(self.features[-1].right_delay, 0.002, places=5)

    def test_nothing_waits_for_a_full_packet(self):
        """TCP_NODELAY, as a subscriber on another machine asks for."""
        publisher = rospy.Publisher(self.namespace + '/stereo_features', StereoFeatures, queue_size=1)
        self.addCleanup(publisher.unregister)
        self.start(loop_closing='true')

        def delays():
            return [not connection.socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
                    for connection in publisher.impl.connections if connection.endpoint_id == self.pipeline.manager]
        self.until(lambda: len(delays()) == 1 and self.is_sent_to_pipeline(publisher))
        self.assertEqual(delays(), [False])

    def test_a_map_that_was_loaded_is_shown_before_the_first_pair(self):
        file = os.path.join(self.folder(), 'map.bag')
        config = self.config('place_recognition: {keyframe_distance: 0.1}\n')
        self.start(config=config, loop_closing='true')
        for i in range(12):
            self.feed(i)
        self.until(lambda: self.call('place_recognition/save_places', SavePlaces, file).success)
        self.tearDown()
        self.setUp()
        graph = self.collect('map_graph', MapGraph)
        self.start(config=config, loop_closing='true', places_file=file)
        self.until(lambda: len(graph) > 0)
        self.assertGreater(len(graph[0].nodes), 1)

    def statuses(self, node, task):
        """Those of that name on /diagnostics since the last run began."""
        name = '%s/%s: %s' % (self.namespace[1:], node, task)
        return [(status.level, status.message) for array in list(self.diagnostics)[self.begin:] for status in array.status
                if status.name.endswith(name)]

    def expect(self, node, task, level, *words):
        self.until(lambda: any(found == level and all(word in message for word in words)
                               for found, message in self.statuses(node, task)))

    def run_for(self, seconds, damage=lambda images: None):
        """Pairs at 10 Hz of wall time, there and back, until the time is over."""
        end, self.begin = time.time() + seconds, len(self.diagnostics)
        while time.time() < end:
            k = self.shown = getattr(self, 'shown', -1) + 1
            i = k % (2 * PAIRS - 2)
            images, infos = self.camera.messages(min(i, 2 * PAIRS - 2 - i), time_of=k)
            damage(images)
            self.camera.publish(images, infos)
            time.sleep(0.1)

    def test_diagnostics_name_the_cause(self):
        ok, warn, error = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
        self.start()
        self.expect('stereo_features', 'input rate', error, 'no pairs yet on', 'left/image_rect')
        self.expect('visual_odometry', 'input rate', error, 'no features yet on')

        self.run_for(6.0)
        for task in ('input rate', 'synchronisation', 'exposure', 'features'):
            self.expect('stereo_features', task, ok)
        self.expect('visual_odometry', 'input rate', ok, 'features a second')
        self.expect('visual_odometry', 'odometry', ok, 'TRACKING')
        self.expect('visual_odometry', 'latency', warn, 'another clock than this machine')
        self.camera.publish(*self.camera.messages(0, time_of=self.shown - 2))
        self.expect('stereo_features', 'synchronisation', warn, '1 pairs late or with wrong stamps')

        def darken(images):
            for image in images:
                image.data = bytes(byte // 32 for byte in image.data)
        self.run_for(3.0, darken)
        self.expect('stereo_features', 'exposure', warn, 'too dark')

        frozen = [image.data for image in self.camera.messages(0)[0]]

        def freeze(images):
            for image, data in zip(images, frozen):
                image.data = data
        self.run_for(3.0, freeze)
        self.expect('stereo_features', 'features', warn, 'the images repeat bit by bit')

        def swap(images):
            images[0].data, images[1].data = images[1].data, images[0].data
        self.run_for(3.0, swap)
        self.expect('stereo_features', 'features', error, 'pairs refused')
        self.expect('stereo_features', 'exposure', ok)

        self.expect('stereo_features', 'input rate', error, 'no pairs for')
        self.expect('visual_odometry', 'odometry', error, 'no features for', 'the last state was')
        self.assertTrue(self.call('visual_odometry/pause', Trigger).success)
        for task in ('odometry', 'input rate'):
            self.expect('visual_odometry', task, ok, 'paused')
        self.features.close()
        self.expect('stereo_features', 'input rate', ok, 'nobody listens')

    def test_pairs_whose_stamps_do_not_go_together_are_said_and_none_is_lost_uncounted(self):
        self.start(queue_size=200)
        pairs, random = 100, np.random.RandomState(1)
        words = 'the nearest stamps of left and right are ', ' to 4.0 ms apart, more than sync_tolerance'
        for k in range(pairs):
            if k == 60:  # 3 s
                self.assertTrue(self.rosout.warned('stereo pairs', 'are not used', 'left and', 'right images without', *words))
            images, infos = self.camera.messages(k % PAIRS, time_of=0.5 * k)
            for message in (images[1], infos[1]):
                message.header.stamp += rospy.Duration.from_sec(random.uniform(-0.004, 0.004))
            self.camera.publish(images, infos)
            time.sleep(0.05)
        self.expect('stereo_features', 'synchronisation', DiagnosticStatus.WARN, 'are not used', *words)

        def counts():
            values = {value.key: value.value for value in self.diagnosis('synchronisation', 'stereo_features').values}
            return [int(values.get(name, 0)) for name in ('unpaired', 'pushed out by newer ones', 'late or with wrong stamps', 'refused')]
        self.until(lambda: len(self.features) + sum(counts()) == pairs)
        self.assertTrue(0 < len(self.features) < 60, len(self.features))
        self.assertGreater(self.features[-1].dropped_pairs, 10)

    def test_a_missing_transform_blocks_nothing(self):
        self.start()
        for i in range(5):
            self.camera.publish(*self.camera.messages(i, frame='mast'))
            self.until(lambda: len(self.features) == i + 1)
        # Each pair waits for 2 s at most.
        self.until(lambda: len(self.info) >= 2)
        self.assertIn("'mast'", self.info[0].reason)
        self.call('visual_odometry/reset', Empty)
        self.broadcaster.sendTransform([camera_transform(FRAME), camera_transform('mast')])
        times = itertools.count(5)
        self.until(lambda: self.is_answered(5, time_of=next(times), frame='mast') and self.info[-1].state == 'TRACKING')

    def test_a_dark_pair_and_a_careless_click_leave_the_map_alone(self):
        self.start(config=self.config('place_recognition: {keyframe_distance: 0.1}\n'), loop_closing='true')
        places = self.listen('place_info', PlaceInfo)
        for i in range(10):
            self.feed(i)
        self.until(lambda: len(places) > 0)
        images, infos = self.camera.dark(10)
        self.feed_messages(images, infos)
        publisher = self.publisher('/initialpose', PoseWithCovarianceStamped)
        click = PoseWithCovarianceStamped()
        click.header.frame_id = 'map'
        click.pose.pose.orientation.w = 1.0
        publisher.publish(click)
        self.until(lambda: self.rosout.warned('initialpose is not used', 'initialpose_while_mapping'))
        known = len(places)
        for i in range(11, 30):
            self.feed(i)
        self.until(lambda: len(places) > known)
        self.assertEqual(self.rosout.errors, [])

    def test_a_camera_that_was_found_is_given_back(self):
        def pipeline(camera, **arguments):
            self.rosout = self.keep(Rosout(self.namespace))
            self.features = self.collect('stereo_features', StereoFeatures)
            self.picture = self.collect('features_image', Image)
            found = self.keep(Pipeline(self.namespace, **arguments))
            self.until(lambda: found.has_loaded('stereo_features', 'visual_odometry'), 60)
            return self.keep(camera)
        times = itertools.count()

        def is_drawn(camera):
            drawn, k = len(self.picture), next(times)
            camera.publish(*camera.messages(k % PAIRS, time_of=k))
            return wait_until(lambda: len(self.picture) > drawn, SILENCE)
        front = pipeline(Camera(self.namespace + '/front', self.sequence, self.clock))
        self.until(front.is_subscribed, 60)
        self.until(lambda: self.rosout.warned('nobody publishes', '/front/left/image_rect', 'find_camera'))
        self.until(lambda: is_drawn(front))
        own = self.keep(Camera(self.namespace, self.sequence, self.clock))
        self.until(lambda: own.is_subscribed() and not front.has_subscribers(), 60)
        self.until(lambda: self.rosout.warned('somebody publishes'))
        self.until(lambda: is_drawn(own))
        own.close()
        self.closeables.remove(own)
        self.until(lambda: is_drawn(front), 60)  # the two drivers take turns
        self.tearDown()
        self.setUp()

        front = pipeline(Camera(self.namespace + '/front', self.sequence, self.clock), config=self.config('stereo_features: {find_camera: false}\n'))
        self.until(lambda: ('out', self.namespace + '/stereo_features', rospy.get_name()) in links(
            self.namespace + '/stereo_vo_manager'))
        time.sleep(3.0)
        self.assertFalse(front.has_subscribers())

    def test_what_was_reconfigured_holds_after_a_respawn(self):
        self.start()
        before = self.feed(0)
        client = dynamic_reconfigure.client.Client(self.namespace + '/stereo_features', timeout=60)
        client.update_configuration({'detector/max_features': 200})
        client.close()
        self.until(lambda: rospy.get_param(self.namespace + '/stereo_features/detector/max_features') == 200)
        name = self.namespace + '/stereo_features'
        self.assertTrue(rospy.ServiceProxy(self.pipeline.manager + '/unload_nodelet', NodeletUnload)(name).success)
        self.until(lambda: not self.camera.has_subscribers())
        self.assertTrue(load_nodelet(self.pipeline.manager, name, PACKAGE + '/StereoFeatures'))
        self.until(lambda: self.camera.is_subscribed() and self.pipeline.is_connected((self.features, )))
        times = itertools.count(1)
        self.until(lambda: self.is_answered(1, time_of=next(times)))
        self.assertGreater(before.detected, 250)
        self.assertEqual(self.info[-1].detected, 200)

    def test_at_most_so_many_pairs_a_second(self):
        self.start(config=self.config('stereo_features: {max_rate: 5.0, opencv_threads: 1}\n'))
        answers = []
        for i in range(0, 20, 2):
            answers.append(self.feed(i))
            self.camera.publish(*self.camera.messages(i + 1))
        answers.append(self.feed(20))
        self.assert_only(answers)
        self.assertEqual({info.dropped_pairs for info in answers}, {0})

    def test_states_and_the_map_are_there_for_others(self):
        self.start()
        pose = self.collect('pose', PoseWithCovarianceStamped)
        cloud = self.collect('map_points', PointCloud2)
        self.until(lambda: self.pipeline.is_connected((pose, cloud)))
        for i in range(5):
            self.assertEqual(self.feed(i).state_id, VoInfo.TRACKING)
        self.until(lambda: len(pose) == 5 and len(cloud) > 0 and cloud[-1].header.stamp == pose[-1].header.stamp)
        self.assertEqual(pose[-1].pose.covariance, self.odometry[-1].pose.covariance)
        self.assertEqual(cloud[-1].header.frame_id, FRAME)
        # Two walls across the way ahead, 2 and 4 m away; the camera's z is ahead.
        ahead = np.frombuffer(cloud[-1].data, np.float32).reshape(-1, cloud[-1].point_step // 4)[:, 2]
        self.assertGreater(len(ahead), 200)
        self.assertGreater(np.mean((abs(ahead - 2) < 0.1) | (abs(ahead - 4) < 0.2)), 0.9)

    def test_a_map_is_only_localised_in_and_a_pose_is_a_hint(self):
        file = os.path.join(self.folder(), 'map.bag')
        small = '{keyframe_distance: 0.1%s}\n'
        self.start(config=self.config('place_recognition: ' + small % ''), loop_closing='true')
        for i in range(40):
            self.feed(i)
        self.until(lambda: self.call('place_recognition/save_places', SavePlaces, file).success)
        self.tearDown()
        self.setUp()
        places = self.collect('place_info', PlaceInfo)
        pose = self.collect('map_pose', PoseWithCovarianceStamped)
        graph = self.collect('map_graph', MapGraph)
        tf = self.keep(Collector('/tf', TFMessage))
        self.start(config=self.config('place_recognition: ' + small % ', localisation_only: true'), loop_closing='true',
                   places_file=file, odom_frame_id='odom_2')
        self.until(lambda: self.pipeline.is_connected((places, pose, graph)) and len(graph) > 0)
        nodes = {node.id: node.pose for node in graph[0].nodes}

        def map_to_odom():
            found = transforms_to('odom_2', tf)
            return matrix_of(found[-1].transform) if found else None
        # Half a metre to the side of where the first session began; told wrong by some centimetres.
        first = round(0.2 / STEP)
        hint = PoseWithCovarianceStamped()
        hint.header.frame_id = 'map'
        hint.pose.pose.position.y = -0.2 + 0.05
        hint.pose.pose.orientation.w = 1.0
        publisher = self.publisher('/initialpose', PoseWithCovarianceStamped)
        publisher.publish(hint)
        time.sleep(0.5)
        self.feed(first)
        self.until(lambda: map_to_odom() is not None)
        self.assertFalse(places[0].located)
        self.assertTrue(self.rosout.warned('initialpose: the robot is placed in the map'), self.rosout.warnings)
        np.testing.assert_allclose(map_to_odom()[:3, 3], [0, -0.15, 0], atol=1e-6)
        for i in range(first + 1, 40):
            self.feed(i)
        self.until(lambda: places[-1].located)
        self.until(lambda: len(pose) > 0 and pose[-1].header.stamp == places[-1].header.stamp)
        true = -STEP * round((pose[-1].header.stamp.to_sec() - EPOCH) * 10)
        self.assertAlmostEqual(pose[-1].pose.pose.position.y, true, delta=0.02)
        covariance = np.array(pose[-1].pose.covariance).reshape(6, 6)
        self.assertTrue(0 < covariance[1, 1] < 0.1**2, covariance[1, 1])
        # What was loaded has not moved, and cannot be saved anew.
        self.until(lambda: len(graph[-1].nodes) > len(nodes))
        for node in graph[-1].nodes:
            if node.id in nodes:
                self.assertEqual(node.pose, nodes[node.id])
        answer = self.call('place_recognition/save_places', SavePlaces, file)
        self.assertFalse(answer.success)
        self.assertIn('localisation_only', answer.message)

    def test_what_a_flight_controller_is_sent(self):
        """As mavros' odometry plugin takes it: REP-147's frames, pose in the parent, twist in the child, both covariances."""
        self.start(odom='/drone/mavros/odometry/out', launch='mavros.launch', mavros='/drone/mavros')
        for i in range(4):
            info = self.feed(i)
        message = self.odometry[-1]
        self.assertEqual((message.header.frame_id, message.child_frame_id), ('odom', 'base_link'))
        self.assertEqual(message.header.stamp, self.camera.messages(3)[0][0].header.stamp)
        # To the right of the way ahead: -y of both frames.
        self.assertAlmostEqual(message.pose.pose.position.y, -3 * STEP, delta=0.2 * STEP)
        self.assertAlmostEqual(message.twist.twist.linear.y, -STEP / 0.1, delta=0.2)
        for covariance in (message.pose.covariance, message.twist.covariance):
            matrix = np.array(covariance).reshape(6, 6)
            np.testing.assert_allclose(matrix, matrix.T)
            self.assertGreater(np.linalg.eigvalsh(matrix)[0], 0.0)
        # The reset counter: one more after every discontinuity.
        self.call('visual_odometry/reset', Empty)
        self.assertEqual(self.feed(4).epoch, info.epoch + 1)
        self.assertEqual(self.odometry[-1].pose.pose.position.y, 0.0)


if __name__ == '__main__':
    rospy.init_node('faults_test')
    rostest.rosrun(PACKAGE, 'faults', Faults, sys.argv)
