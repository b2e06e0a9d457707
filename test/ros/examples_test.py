#!/usr/bin/env python3
"""The examples of subscribers, on made-up descriptors whose answers are known and on a converted sequence."""

import os
import subprocess
import sys
import unittest

import numpy as np
import rospy
import rostest
import yaml
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32

from kitti_replay import (PACKAGE, Collector, Rosout, ended_by, is_connected, links, nodelet_process, run_tool, street_dir,
                          temporary_folder, wait_until)
from stereo_descriptor_vo.msg import StereoFeatures

COUNT = 101  # odd: the median is one of them
HALF_BYTES = 64
FLIPPED_BITS = 51


def random_rows(random, count):
    """Rows of two halves that differ in FLIPPED_BITS bits each; rows of different features have nothing in common."""
    left = random.integers(0, 2, (count, 8 * HALF_BYTES), dtype=np.uint8)
    right = left.copy()
    for row in right:
        row[random.permutation(row.size)[:FLIPPED_BITS]] ^= 1
    return np.packbits(np.hstack((left, right)), axis=1)


def features_message(rows, stream_epoch=0):
    """A camera of fx = 500 px and 0.1 m: disparities around 10 px are depths around 5 m."""
    n = len(rows)
    message = StereoFeatures()
    message.header.stamp = rospy.Time.now()
    message.header.frame_id = 'left_optical'
    message.image_width, message.image_height = 640, 480
    message.fx, message.fy, message.cx, message.cy, message.baseline = 500.0, 500.0, 320.0, 240.0, 0.1
    message.descriptor, message.layout, message.element_type = 'freak', 'left+right', 'bits'
    message.bytes_per_row = rows.shape[1]
    message.stream_epoch = stream_epoch
    message.u, message.v = [100.0] * n, [100.0] * n
    message.disparity = list(np.linspace(5.0, 15.0, n))
    message.dv, message.angle, message.response = [0.0] * n, [-1.0] * n, [1.0] * n
    message.size = [7.0] * n
    message.descriptors = rows.tobytes()
    return message


class Examples(unittest.TestCase):
    def listen(self, namespace):
        self.share = Collector(namespace + '/descriptor_counter/match_share', Float32)
        self.half_distance = Collector(namespace + '/descriptor_listener/half_distance', Float32)
        self.depth = Collector(namespace + '/descriptor_listener/median_depth', Float32)
        for collector in (self.share, self.half_distance, self.depth):
            self.addCleanup(collector.close)
        self.assertTrue(wait_until(lambda: is_connected(namespace + '/stereo_vo_manager', [self.share]) and
                                   is_connected(namespace + '/descriptor_listener', [self.half_distance, self.depth])),
                        [links(namespace + '/' + node) for node in ('stereo_vo_manager', 'descriptor_listener')])

    def publish_until_seen(self, message):
        answers = len(self.depth)
        self.publisher.publish(message)
        self.assertTrue(wait_until(lambda: len(self.depth) > answers and len(self.half_distance) > answers))

    def test_answers_on_known_descriptors(self):
        random = np.random.default_rng(1)
        self.listen('/synthetic')
        rosout = Rosout('/synthetic')
        self.addCleanup(rosout.close)
        self.publisher = rospy.Publisher('/synthetic/stereo_features', StereoFeatures, queue_size=10)
        nodes = ['/synthetic/stereo_vo_manager', '/synthetic/descriptor_listener']
        self.assertTrue(wait_until(lambda: all(
            ('out', self.publisher.resolved_name, node) in links(rospy.get_name()) and
            ('in', self.publisher.resolved_name) in links(node) and
            ('out', '/rosout', rospy.get_name()) in links(node) for node in nodes)))

        first = random_rows(random, COUNT)
        self.publish_until_seen(features_message(first))  # nothing to compare with yet: no share

        kept = 61
        second = random.permutation(np.vstack((first[:kept], random_rows(random, COUNT - kept))))
        self.publish_until_seen(features_message(second))
        self.assertTrue(wait_until(lambda: len(self.share) == 1))
        self.assertAlmostEqual(self.share[0].data, kept / COUNT, places=6)
        self.assertAlmostEqual(self.half_distance[-1].data, FLIPPED_BITS / (8 * HALF_BYTES), places=6)
        self.assertAlmostEqual(self.depth[-1].data, 5.0, places=5)

        # Refused by both with one error each, which ends neither.
        damaged = features_message(second)
        damaged.descriptors = damaged.descriptors[:-1]
        answers = len(self.depth)
        for _ in range(5):
            self.publisher.publish(damaged)
        self.assertTrue(wait_until(lambda: len(rosout.errors) >= len(nodes)), rosout.errors)

        # Answers come in their order: those to this one are the next.
        self.publish_until_seen(features_message(second))
        self.assertTrue(wait_until(lambda: len(self.share) > 1))
        self.assertAlmostEqual(self.share[1].data, 1.0, places=6)
        self.assertEqual((len(self.depth), len(self.half_distance)), (answers + 1, answers + 1))

        # Another stream is not compared, an empty pair continues it with nothing.
        self.publish_until_seen(features_message(second, stream_epoch=1))
        self.publisher.publish(features_message(second[:0], stream_epoch=1))
        self.assertTrue(wait_until(lambda: len(self.share) > 2))
        self.assertEqual([m.data for m in self.share[2:]], [0.0])
        self.assertEqual(len(rosout.errors), len(nodes), rosout.errors)
        self.assertTrue(all('StereoFeatures message refused' in error for error in rosout.errors), rosout.errors)

    def test_side_by_side_images_become_a_pair(self):
        directory = temporary_folder(self)
        arguments = []
        for side, tx in (('left', 0.0), ('right', -50.0)):
            path = os.path.join(directory, side + ' info.yaml')
            with open(path, 'w') as file:
                def matrix(rows, cols, data):
                    return {'rows': rows, 'cols': cols, 'data': data}
                yaml.safe_dump({'image_width': 4, 'image_height': 3, 'camera_name': side, 'distortion_model': 'plumb_bob',
                                'distortion_coefficients': matrix(1, 5, [0.1, 0.0, 0.0, 0.0, 0.0]),
                                'camera_matrix': matrix(3, 3, [500.0, 0, 2, 0, 500, 1.5, 0, 0, 1]),
                                'rectification_matrix': matrix(3, 3, [1.0, 0, 0, 0, 1, 0, 0, 0, 1]),
                                'projection_matrix': matrix(3, 4, [500.0, 0, 2, tx, 0, 500, 1.5, 0, 0, 0, 1, 0])}, file)
            arguments.append('_%s_camera_info:=%s' % (side, path))
        ended_by(self, nodelet_process('load', PACKAGE + '/SideBySideSplitter', '/split/manager', '--no-bond', '__ns:=/split',
                                       '__name:=splitter', '_frame_id:=left_optical', *arguments))
        images = [Collector('/split/%s/image_raw' % side, Image) for side in ('left', 'right')]
        infos = [Collector('/split/%s/camera_info' % side, CameraInfo) for side in ('left', 'right')]
        for collector in images + infos:
            self.addCleanup(collector.close)
        publisher = rospy.Publisher('/split/image_raw', Image, queue_size=10)
        self.assertTrue(wait_until(lambda: is_connected('/split/manager', images + infos, ['/split/image_raw']) and
                                   ('out', '/split/image_raw', '/split/manager') in links(rospy.get_name())))
        for count, (encoding, size) in enumerate((('mono8', 1), ('bgr8', 3), ('mono16', 2), ('yuv422', 2))):
            whole = np.random.default_rng(1).integers(0, 256, (3, 8, size), dtype=np.uint8)
            padded = np.concatenate((whole.reshape(3, -1), np.zeros((3, 5), np.uint8)), axis=1)
            message = Image(height=3, width=8, encoding=encoding, step=padded.shape[1], data=padded.tobytes())
            message.header.stamp, message.header.frame_id = rospy.Time(7, count), 'camera'
            publisher.publish(message)
            self.assertTrue(wait_until(lambda: all(len(c) == count + 1 for c in images + infos)), encoding)
            for half, image, info in zip((whole[:, :4], whole[:, 4:]), images, infos):
                self.assertEqual(np.frombuffer(image[-1].data, np.uint8).tolist(), half.ravel().tolist(), encoding)
                self.assertEqual((image[-1].width, image[-1].height, image[-1].encoding, image[-1].step), (4, 3, encoding, 4 * size))
                for header in (image[-1].header, info[-1].header):
                    self.assertEqual((header.stamp, header.frame_id), (message.header.stamp, 'left_optical'))
        self.assertEqual((infos[0][0].width, infos[0][0].D[0], infos[1][0].P[3]), (4, 0.1, -50.0))

    def test_camera_info_that_would_end_image_proc_is_kept_from_it(self):
        for name, *remappings in ((PACKAGE + '/RectifiableInfo', ),
                                  ('image_proc/rectify', 'camera_info:=rectifiable/camera_info', 'image_mono:=image_mono')):
            ended_by(self, nodelet_process('load', name, '/split/manager', '--no-bond', '__ns:=/guarded',
                                           '__name:=' + name.split('/')[1], *remappings))
        images = Collector('/guarded/image_rect', Image)
        self.addCleanup(images.close)
        rosout = Rosout('/split')
        self.addCleanup(rosout.close)
        image_publisher = rospy.Publisher('/guarded/image_mono', Image, queue_size=10)
        info_publisher = rospy.Publisher('/guarded/camera_info', CameraInfo, queue_size=10)
        inputs = ['/guarded/' + topic for topic in ('image_mono', 'camera_info', 'rectifiable/camera_info')]
        self.assertTrue(wait_until(lambda: is_connected('/split/manager', [images], inputs) and
                                   links(rospy.get_name()) >= {('out', topic, '/split/manager') for topic in inputs[:2]}))
        info = CameraInfo(width=64, height=48, K=[50, 0, 32, 0, 50, 24, 0, 0, 1], R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                          P=[50, 0, 32, 0, 0, 50, 24, 0, 0, 0, 1, 0])
        image = Image(width=64, height=48, step=64, encoding='mono8', data=bytes(64 * 48))
        seconds = 0
        for model, numbers, words in (('fisheye', [0.01, 0, 0, 0], None), ('omnidirectional', [0.01, 0, 0, 0], 'equidistant'),
                                      ('kannala_brandt4', [0.01, 0, 0, 0], None), ('', [], None),
                                      ('plumb_bob', [0.01, 0, 0], '3 numbers'), ('plumb_bob', [0.01, 0, 0, 0, 0], None),
                                      ('equidistant', [0.01, 0, 0, 0, 0], "4 are expected"), ('', [0.01], "''")):
            seconds += 10
            info.distortion_model, info.D = model, numbers
            info.header.stamp = image.header.stamp = rospy.Time(seconds)
            before = len(images)
            info_publisher.publish(info)
            image_publisher.publish(image)
            if words is None:
                self.assertTrue(wait_until(lambda: len(images) > before), model)
            else:
                # Said once in five seconds.
                self.assertTrue(wait_until(lambda: rosout.said('no image is rectified', words) or
                                           info_publisher.publish(info) or rospy.sleep(0.5)), (words, rosout.errors))

    def test_answers_on_a_drive(self):
        pairs = 10
        sequence = street_dir()
        bag = os.path.join(temporary_folder(self), 'sequence.bag')
        run_tool('convert', sequence, '--frames', str(pairs), '--output', bag)
        self.listen('/stereo')
        nodes = ['/stereo/stereo_vo_manager', '/stereo/descriptor_listener']
        self.assertTrue(wait_until(lambda: all(('in', '/stereo/stereo_features') in links(node) for node in nodes)))
        topics = ['/stereo/%s/%s' % (side, what) for side in ('left', 'right') for what in ('image_rect', 'camera_info')]
        subprocess.run(['rosbag', 'play', '--quiet', '--wait-for-subscribers', '--rate', '0.5', bag, '--topics'] +
                       topics + ['/tf_static'], check=True)
        self.assertTrue(wait_until(lambda: (len(self.share), len(self.half_distance), len(self.depth)) ==
                                   (pairs - 1, pairs, pairs)), [len(self.share), len(self.depth)])
        print('match shares: %s' % [round(m.data, 3) for m in self.share])
        print('half distances: %s' % [round(m.data, 3) for m in self.half_distance])
        print('median depths: %s m' % [round(m.data, 1) for m in self.depth])
        # The car moves a metre from pair to pair: what is ten metres away keeps its looks to a tenth, so that at least
        # a third must be recognised. Unrelated rows, see above, give nothing at all.
        self.assertGreater(min(m.data for m in self.share), 1 / 3)
        # Both halves show one place: they are as alike as what the odometry accepts for a match.
        self.assertLess(max(m.data for m in self.half_distance), 0.3)
        # A street: the road begins some metres ahead, houses stand within 100 m.
        for m in self.depth:
            self.assertTrue(4.0 < m.data < 100.0, m.data)


if __name__ == '__main__':
    rospy.init_node('examples_test')
    rostest.rosrun(PACKAGE, 'examples', Examples, sys.argv)
