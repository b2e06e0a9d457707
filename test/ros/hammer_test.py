#!/usr/bin/env python3
"""All nodelets in one manager are unloaded, loaded, reconfigured, reset and asked for everything at once, while pairs come:
nothing may break, hang or grow. What the answers are is left to the other tests."""

import copy
import itertools
import os
import statistics
import sys
import tempfile
import threading
import time
import unittest

import dynamic_reconfigure.client
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Pose
from nodelet.srv import NodeletLoad, NodeletUnload
from sensor_msgs.msg import Image
from std_srvs.srv import Empty, Trigger

from kitti_replay import FRAME, PACKAGE, Camera, Collector, Rosout, SimulatedClock, StereoSequence, node_pid, wait_until
from live_test import PAIRS
from pipeline_case import camera_transform
from stereo_descriptor_vo.msg import Place, PlaceInfo, PlaceRequest, PlaceSignature, VoInfo
from stereo_descriptor_vo.srv import GetPlace, LoadPlaces, ResetToPose, SavePlaces, SaveTrajectory

NAMESPACE = '/stereo'
MANAGER = NAMESPACE + '/stereo_vo_manager'
NODELETS = {'stereo_features': 'StereoFeatures', 'visual_odometry': 'VisualOdometry', 'features_image': 'FeaturesImage',
            'place_recognition': 'PlaceRecognition'}


def resident_memory(pid):
    """MB."""
    with open('/proc/%d/statm' % pid) as file:
        return int(file.read().split()[1]) * os.sysconf('SC_PAGE_SIZE') / 2**20


class Hammer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.clock = SimulatedClock()
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform(camera_transform(FRAME))
        cls.camera = Camera(NAMESPACE, StereoSequence(PAIRS), cls.clock)
        cls.info = Collector(NAMESPACE + '/vo_info', VoInfo)
        cls.places = Collector(NAMESPACE + '/place_info', PlaceInfo)
        cls.signatures = Collector(NAMESPACE + '/place_signature', PlaceSignature)
        cls.picture = Collector(NAMESPACE + '/features_image', Image)
        cls.rosout = Rosout(NAMESPACE)
        cls.answered = itertools.count(1)

    def setUp(self):
        self.load = rospy.ServiceProxy(MANAGER + '/load_nodelet', NodeletLoad)
        self.unload = rospy.ServiceProxy(MANAGER + '/unload_nodelet', NodeletUnload)
        self.load.wait_for_service(60)
        self.assertTrue(wait_until(self.camera.is_subscribed, 60), 'the pipeline did not start')
        self.pid = node_pid(MANAGER)
        self.publishing = True
        self.publisher = threading.Thread(target=self.publish)
        self.publisher.start()
        self.addCleanup(self.stop_publishing)
        self.assert_alive()

    def publish(self):
        """There and back along the sequence."""
        turns = 2 * (PAIRS - 1)
        while self.publishing:
            k = next(self.answered)
            self.camera.publish(*self.camera.messages(min(k % turns, turns - k % turns), time_of=k))
            for collector in (self.picture, self.info, self.places):
                del collector.messages[:-100]
            time.sleep(0.05)

    def stop_publishing(self):
        self.publishing = False
        self.publisher.join()

    def assert_alive(self):
        """The manager is the one of before, and odometry and place recognition answer."""
        for collector in (self.info, self.places):
            last = collector[-1] if collector else None
            self.assertTrue(wait_until(lambda: collector and collector[-1] is not last, 120), self.rosout.errors)
        self.assertEqual(node_pid(MANAGER), self.pid, 'the nodelet manager died')

    def reload(self, name):
        self.assertTrue(self.unload('%s/%s' % (NAMESPACE, name)).success)
        topics = 'place_signature', 'place_request', 'place_answer'
        remaps = ['other/' + topic for topic in topics], ['/other/' + topic for topic in topics]
        self.assertTrue(self.load('%s/%s' % (NAMESPACE, name), '%s/%s' % (PACKAGE, NODELETS[name]),
                                  *(remaps if name == 'place_recognition' else ([], [])), [], '').success)
        self.assertEqual(node_pid(MANAGER), self.pid, 'the nodelet manager died')

    def test_1_unloaded_and_loaded(self):
        cycles, growth = rospy.get_param('~cycles'), rospy.get_param('~growth')
        memory = []
        for _ in range(cycles):
            for name in NODELETS:
                self.reload(name)
            self.assert_alive()
            memory.append(resident_memory(self.pid))
        if growth > 0:
            before, after = (statistics.median(part) for part in (memory[cycles // 4:cycles // 2], memory[-(cycles // 4):]))
            print('%d cycles: %.1f MB in the second quarter, %.1f MB in the last' % (cycles, before, after), flush=True)
            self.assertLessEqual(after - before, growth, memory)

    def test_2_everything_at_once(self):
        directory = tempfile.TemporaryDirectory(prefix='sdvo_hammer_')
        self.addCleanup(directory.cleanup)
        rounds = rospy.get_param('~rounds')
        done = {}

        def call(name, service, *arguments):
            """A nodelet that is just unloaded has no services."""
            name = '%s/%s' % (NAMESPACE, name)
            try:
                rospy.ServiceProxy(name, service)(*arguments)
            except (rospy.ServiceException, rospy.exceptions.TransportException):
                return
            done[name] = done.get(name, 0) + 1

        def reload():
            for name in NODELETS:
                self.reload(name)
                time.sleep(0.5)

        def reconfigure():
            client = dynamic_reconfigure.client.Client(NAMESPACE + '/stereo_features', timeout=120)
            for options in ({'detector/max_features': 300}, {'size_curve/max_size': 25.0}, {'descriptor/type': 'orb'},
                            {'descriptor/type': 'freak', 'size_curve/max_size': 20.0, 'detector/max_features': 1500}):
                try:
                    client.update_configuration(options)
                    done['reconfigure'] = done.get('reconfigure', 0) + 1
                except (rospy.ServiceException, rospy.exceptions.TransportException,
                        dynamic_reconfigure.DynamicReconfigureCallbackException):
                    pass
            client.close()

        def odometry():
            pose = Pose()
            pose.orientation.w = 1.0
            call('visual_odometry/reset', Empty)
            call('visual_odometry/reset_to_pose', ResetToPose, pose)
            call('visual_odometry/pause', Trigger)
            call('visual_odometry/resume', Trigger)
            call('visual_odometry/save_trajectory', SaveTrajectory, os.path.join(directory.name, 'poses.txt'), 'tum')

        def places():
            file = os.path.join(directory.name, 'places.bag')
            call('place_recognition/save_places', SavePlaces, file)
            call('place_recognition/get_place', GetPlace, 0)
            call('place_recognition/load_places', LoadPlaces, file)
            call('place_recognition/pause', Trigger)
            call('place_recognition/resume', Trigger)
            call('place_recognition/reset', Empty)

        def look():
            listener = Collector(NAMESPACE + '/features_image', Image)
            time.sleep(0.3)
            listener.close()

        def other_robot():
            """It has been where the first one is."""
            for signature in self.signatures[-3:]:
                signature = copy.copy(signature)
                signature.robot = '/other'
                self.other_signatures.publish(signature)
            time.sleep(0.2)

        answers = rospy.Publisher('/other/place_answer', Place, queue_size=10)

        def answer(request):
            try:
                place = rospy.ServiceProxy(NAMESPACE + '/place_recognition/get_place', GetPlace)(request.id).place
            except rospy.ServiceException:
                return
            place.robot = request.robot
            answers.publish(place)
            done['/other'] = done.get('/other', 0) + 1
        requests = rospy.Subscriber('/other/place_request', PlaceRequest, answer)
        self.addCleanup(requests.unregister)
        self.other_signatures = rospy.Publisher('/other/place_signature', PlaceSignature, queue_size=10)
        failures = []

        def repeat(action):
            try:
                for _ in range(rounds):
                    action()
            except Exception as e:  # of a thread: told below
                failures.append('%s: %r' % (action.__name__, e))

        threads = [threading.Thread(target=repeat, args=(action, ), daemon=True)
                   for action in (reload, reconfigure, odometry, places, look, other_robot)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(1500)
        self.assertFalse([thread for thread in threads if thread.is_alive()], 'hangs')
        self.assertEqual(failures, [])
        print('answered: %s' % done, flush=True)
        for name in ('reset', 'pause', 'resume', 'save_trajectory'):
            self.assertGreater(done.get('%s/visual_odometry/%s' % (NAMESPACE, name), 0), 0)
        for name in ('reset', 'pause', 'resume', 'save_places', 'load_places', 'get_place'):
            self.assertGreater(done.get('%s/place_recognition/%s' % (NAMESPACE, name), 0), 0)
        # A pause may have been the last that reached a nodelet.
        call('visual_odometry/resume', Trigger)
        call('place_recognition/resume', Trigger)
        self.assert_alive()


if __name__ == '__main__':
    rospy.init_node('hammer_test')
    rostest.rosrun(PACKAGE, 'hammer', Hammer, sys.argv)
