#!/usr/bin/env python3
"""A camera that sends compressed images. PNG loses nothing, so all that comes out is as from the raw images; JPEG loses
little."""

import sys
import unittest

import cv2
import rospy
import rostest
from sensor_msgs.msg import CompressedImage

from kitti_replay import (PACKAGE, Camera, Collector, Pipeline, Rosout, SimulatedClock, StereoSequence, is_connected,
                          wait_until)
from stereo_descriptor_vo.msg import StereoFeatures

PAIRS = 8


class CompressedCamera(Camera):
    """The same camera behind a slow link: its images are compressed, all else is as before."""

    def __init__(self, namespace, sequence, clock, extension):
        super().__init__(namespace, sequence, clock)
        self.extension = extension
        for publisher in self.images:
            publisher.unregister()
        self.images = [rospy.Publisher('%s/%s/image_rect/compressed' % (namespace, side), CompressedImage, queue_size=100)
                       for side in ('left', 'right')]

    def messages(self, i, *arguments):
        images, infos = super().messages(i, *arguments)
        compressed = []
        for image, grey in zip(images, self.sequence.pairs[i]):
            message = CompressedImage(header=image.header, format='mono8; %s compressed mono8' % self.extension)
            message.data = cv2.imencode('.' + self.extension, grey)[1].tobytes()
            compressed.append(message)
        return compressed, infos


class Compressed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.clock = SimulatedClock()
        cls.sequence = StereoSequence(PAIRS)

    def run_pipeline(self, namespace, camera):
        """The features of all pairs."""
        features = Collector(namespace + '/stereo_features', StereoFeatures)
        rosout = Rosout(namespace)
        pipeline = Pipeline(namespace, publish_tf='false')
        try:
            self.assertTrue(wait_until(lambda: camera.is_subscribed() and is_connected(pipeline.manager, [features]), 60),
                            'the pipeline did not start')
            for i in range(PAIRS):
                images, infos = camera.messages(i)
                camera.publish(images, infos)
                self.assertTrue(wait_until(lambda: features.has(images[0].header.stamp)), (i, rosout.errors))
        finally:
            pipeline.close()
            camera.close()
        return features

    def test_compressed_pairs_are_as_good_as_raw_ones(self):
        raw = self.run_pipeline('/raw', Camera('/raw', self.sequence, self.clock))
        png = self.run_pipeline('/compressed', CompressedCamera('/compressed', self.sequence, self.clock, 'png'))
        self.assertEqual(len(png), PAIRS)
        for one, other in zip(raw, png):
            self.assertGreater(len(one.u), 300)
            self.assertEqual((one.u, one.v, one.disparity, one.descriptors), (other.u, other.v, other.disparity, other.descriptors))
        jpeg = self.run_pipeline('/compressed', CompressedCamera('/compressed', self.sequence, self.clock, 'jpg'))
        for one, other in zip(raw, jpeg):
            self.assertEqual(one.header.stamp, other.header.stamp)
            self.assertGreater(len(other.u), 0.8 * len(one.u))


if __name__ == '__main__':
    rospy.init_node('compressed_test')
    rostest.rosrun(PACKAGE, 'compressed', Compressed, sys.argv)
