"""The launched pipeline with a camera that is the test itself: what the tests of its faults share."""

import math
import os
import unittest

import dynamic_reconfigure.client
import rospy
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry

from kitti_replay import FRAME, Camera, Collector, Pipeline, Rosout, SimulatedClock, links, temporary_folder, wait_until
from stereo_descriptor_vo.msg import StereoFeatures, VoInfo

SILENCE = 1.0  # s; a pair takes a tenth of it


def camera_transform(frame):
    """Of a camera that looks ahead, at the base's origin."""
    transform = TransformStamped()
    transform.header.frame_id = 'base_link'
    transform.child_frame_id = frame
    q = transform.transform.rotation
    q.x, q.y, q.z, q.w = -0.5, 0.5, -0.5, 0.5  # optical: z forward, x right
    return transform


def planar_transform(parent, child, stamp, x=0.0, y=0.0, yaw=0.0):
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id, transform.header.stamp = parent, child, stamp
    transform.transform.translation.x, transform.transform.translation.y = x, y
    transform.transform.rotation.z, transform.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return transform


class PipelineCase(unittest.TestCase):
    """Every test has a namespace and a pipeline of its own."""

    tests = 0

    @classmethod
    def setUpClass(cls, sequence):
        cls.sequence = sequence
        cls.clock = SimulatedClock()
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform(camera_transform(FRAME))

    def setUp(self):
        PipelineCase.tests += 1
        self.namespace = '/case_%d' % PipelineCase.tests
        self.closeables = []

    def tearDown(self):
        for closeable in reversed(self.closeables):
            if isinstance(closeable, Pipeline):  # which has names of its own: the next test need not wait for its end
                closeable.process.terminate()
                self.addClassCleanup(closeable.close)
            else:
                closeable.close()

    def keep(self, closeable):
        self.closeables.append(closeable)
        return closeable

    def until(self, condition, timeout=30.0):
        """What must happen; else the test fails with all that was said and answered."""
        if not wait_until(condition, timeout):
            kept = {c.subscriber.resolved_name: len(c) for c in self.closeables if isinstance(c, Collector)}
            said = [(c.errors, c.warnings) for c in self.closeables if isinstance(c, Rosout)]
            answers = [(info.state, info.epoch, info.reason) for info in list(getattr(self, 'info', ()))[-5:]]
            self.fail('waited in vain; messages: %s; errors, warnings: %s; last answers: %s' % (kept, said, answers))

    def config(self, text):
        """A file of parameters."""
        path = os.path.join(self.folder(), 'config.yaml')
        with open(path, 'w') as file:
            file.write(text)
        return path

    def folder(self):
        return temporary_folder(self)

    def call(self, name, service_type, *arguments):
        return rospy.ServiceProxy('%s/%s' % (self.namespace, name), service_type)(*arguments)

    def collect(self, topic, message_type):
        return self.keep(Collector('%s/%s' % (self.namespace, topic), message_type))

    def listen(self, topic, message_type):
        """collect(); returns once the pipeline sends to it."""
        collector = self.collect(topic, message_type)
        self.until(lambda: self.pipeline.is_connected((collector, )))
        return collector

    def publisher(self, topic, message_type):
        """Of what the pipeline takes in; returns once it does. With a slash: of a topic outside of the namespace."""
        publisher = rospy.Publisher(topic if topic.startswith('/') else '%s/%s' % (self.namespace, topic), message_type, queue_size=500)
        self.addCleanup(publisher.unregister)
        self.until(lambda: self.is_sent_to_pipeline(publisher))
        return publisher

    def tf_broadcaster(self):
        """Of transforms that move; returns once the pipeline takes them in."""
        tf = self.keep(tf2_ros.TransformBroadcaster())
        tf.close = tf.pub_tf.unregister
        self.until(lambda: self.is_sent_to_pipeline(tf.pub_tf))
        return tf

    def reconfigure(self, node):
        return self.keep(dynamic_reconfigure.client.Client('%s/%s' % (self.namespace, node), timeout=60))

    def start(self, odom=None, **arguments):
        """Launches the pipeline and returns when everything is connected to it. `odom`: the topic's name, where it is another."""
        self.odometry = self.keep(Collector(odom or self.namespace + '/odom', Odometry))
        self.info = self.collect('vo_info', VoInfo)
        self.features = self.collect('stereo_features', StereoFeatures)
        self.diagnostics = self.keep(Collector('/diagnostics', DiagnosticArray))
        self.rosout = self.keep(Rosout(self.namespace))
        self.camera = self.keep(Camera(self.namespace, self.sequence, self.clock))
        self.pipeline = self.keep(Pipeline(self.namespace, **arguments))
        nodelets = ['stereo_features', 'visual_odometry'] + ['place_recognition'] * (arguments.get('loop_closing') == 'true')
        self.until(lambda: self.camera.is_subscribed() and self.pipeline.has_loaded(*nodelets) and
                   self.pipeline.is_connected((self.odometry, self.info, self.features)), 60)
        self.pid = self.pipeline.pid()
        self.assertIsNotNone(self.pid)

    def feed(self, i, **options):
        """Publishes pair i and returns the VoInfo it gives."""
        return self.feed_messages(*self.camera.messages(i, **options))

    def is_answered(self, i, **options):
        """Whether pair i gives a VoInfo within a while."""
        images, infos = self.camera.messages(i, **options)
        self.camera.publish(images, infos)
        return wait_until(lambda: self.info.has(images[0].header.stamp), SILENCE)

    def feed_messages(self, images, infos):
        """Returns when all that belongs to the pair has arrived: topics are ordered in themselves, not among each other."""
        stamp = images[0].header.stamp
        answers, features, poses = len(self.info), len(self.features), len(self.odometry)
        self.camera.publish(images, infos)
        self.until(lambda: len(self.info) > answers)
        info = self.info[answers]
        self.assertEqual(info.header.stamp, stamp)
        self.until(lambda: any(m.header.stamp == stamp for m in self.features[features:]))
        if info.state in ('TRACKING', 'DEGRADED'):
            self.until(lambda: len(self.odometry) > poses)
        return info

    def assert_only(self, infos):
        """All that came were answers to these pairs, the last of which has just been fed: topics keep their order."""
        stamps = [info.header.stamp for info in infos]
        for collector in (self.info, self.features, self.odometry):
            self.assertEqual([message.header.stamp for message in collector], stamps)

    def is_ours(self, diagnostics):
        """Whether a message of /diagnostics is of this namespace."""
        return any(status.name.startswith(self.namespace[1:] + '/') for status in diagnostics.status)

    def diagnosis(self, task='odometry', node='visual_odometry'):
        """The newest status of a task of ours on /diagnostics."""
        name = '%s/%s: %s' % (self.namespace, node, task)
        found = [status for array in list(self.diagnostics) for status in array.status if status.name.endswith(name[1:])]
        return found[-1] if found else DiagnosticStatus()

    def is_sent_to_pipeline(self, publisher):
        """Whether the messages of a publisher of ours reach the nodelets."""
        return ('out', publisher.resolved_name, self.pipeline.manager) in links(rospy.get_name())

    def assert_alive(self):
        self.assertEqual(self.pipeline.pid(), self.pid, 'the nodelet manager died')
