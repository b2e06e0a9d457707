#!/usr/bin/env python3
"""Places recognised on made-up features: rounds through a ring of points, by an odometry that drifts. The test is the clock, the
image side and the odometry, and waits for the answer to each pair; every pair is a key frame."""

import io
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np
import rosbag
import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry, Path
from std_srvs.srv import Empty, Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from kitti_replay import (FRAME, PACKAGE, Collector, Rosout, SimulatedClock, links, matrix_of, node_pid, temporary_folder,
                          transforms_to, wait_until)
from pipeline_case import camera_transform
from stereo_descriptor_vo.msg import MapGraph, PlaceInfo, PlaceMatch, PlaceRequest, PlaceSignature, StereoFeatures, VoInfo
from stereo_descriptor_vo.srv import GetPlace, LoadPlaces, SavePlaces

WIDTH, HEIGHT, FOCAL, BASELINE = 640, 240, 320.0, 0.5
RADIUS, STEP = 15.0, 3.2  # m
LAP = 2 * np.pi * RADIUS / STEP  # pairs
ROW = 128  # bytes
OPTICAL = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])  # T_base_camera


def quaternion_of(rotation):
    """x, y, z, w of a turn about the vertical axis."""
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    return 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)


def planar(x, y, yaw):
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def on_the_ring(pair):
    """Pose of the base in the world."""
    angle = pair * STEP / RADIUS
    return planar(RADIUS * np.sin(angle), RADIUS * (1 - np.cos(angle)), angle)


class Ring:
    """Points with a descriptor each, on both sides of the way."""

    def __init__(self):
        random = np.random.RandomState(5)
        angle, distance = random.uniform(0, 2 * np.pi, 6000), random.uniform(-12, 25, 6000)
        distance = np.where(np.abs(distance) < 2, distance + 4, distance)
        radius = RADIUS + distance
        self.points = np.stack([radius * np.sin(angle), RADIUS - radius * np.cos(angle), random.uniform(-2, 5, 6000),
                                np.ones(6000)])
        self.rows = random.randint(0, 256, (6000, ROW)).astype(np.uint8)
        self.random = random

    def seen_from(self, T_world_base, stamp, focal=FOCAL):
        points = np.linalg.inv(T_world_base @ OPTICAL) @ self.points
        near = (points[2] > 3) & (points[2] < 30)
        rows, points = self.rows[near], points[:, near]
        u = focal * points[0] / points[2] + WIDTH / 2
        v = focal * points[1] / points[2] + HEIGHT / 2
        seen = (u > 0) & (u < WIDTH - 1) & (v > 0) & (v < HEIGHT - 1)
        u, v, rows, z = u[seen], v[seen], rows[seen], points[2][seen]
        n = len(u)
        disparity = focal * BASELINE / z + self.random.normal(0, 0.1, n)
        message = StereoFeatures(image_width=WIDTH, image_height=HEIGHT, fx=focal, fy=focal, cx=WIDTH / 2, cy=HEIGHT / 2,
                                 baseline=BASELINE, descriptor='freak', layout='left+right', element_type='bits',
                                 bytes_per_row=ROW, u=u + self.random.normal(0, 0.2, n), v=v + self.random.normal(0, 0.2, n),
                                 disparity=disparity, dv=np.zeros(n), size=np.full(n, 10.0), angle=np.full(n, -1.0),
                                 response=np.ones(n), descriptors=rows.tobytes(), patches=b'')
        message.header.stamp, message.header.frame_id = stamp, FRAME
        message.u, message.v = np.clip(message.u, 0, WIDTH - 1), np.clip(message.v, 0, HEIGHT - 1)
        return message


class Robot:
    """Drives round the ring and tells what an odometry would that begins where the robot stands and turns a little too much."""

    def __init__(self, namespace, ring, clock, start=0, focal=FOCAL):
        self.ring, self.clock, self.start, self.focal = ring, clock, start, focal
        self.pair, self.odom_frame = -1, namespace.strip('/') + '_odom'
        self.odometry = np.eye(4)
        self.stamp = clock.now
        self.session, self.epoch = rospy.Time(7), 0
        self.features, self.odom, self.info = (
            rospy.Publisher('%s/%s' % (namespace, topic), message, queue_size=100)
            for topic, message in (('stereo_features', StereoFeatures), ('odom', Odometry), ('vo_info', VoInfo)))

    def truth(self):
        return on_the_ring(self.start + self.pair)

    def drive(self, is_lost=False):
        """Publishes the next pair."""
        before = self.truth()
        self.pair += 1
        if self.pair > 0:
            drift = planar(0.02 * STEP, 0, np.radians(0.04 * STEP))
            self.odometry = self.odometry @ np.linalg.inv(before) @ self.truth() @ drift
        self.stamp += rospy.Duration(1)
        self.clock.advance_to(self.stamp)
        self.publish(is_lost)

    def publish(self, is_lost):
        odometry = Odometry(child_frame_id='base_link')
        odometry.header.stamp, odometry.header.frame_id = self.stamp, self.odom_frame
        p, q = odometry.pose.pose.position, odometry.pose.pose.orientation
        p.x, p.y, p.z = self.odometry[:3, 3]
        q.x, q.y, q.z, q.w = quaternion_of(self.odometry)
        odometry.twist.covariance = np.diag([1e-3] * 3 + [1e-5] * 3).flatten()
        info = VoInfo(state='LOST' if is_lost else 'TRACKING', session=self.session, epoch=self.epoch)
        info.header.stamp, info.header.frame_id = self.stamp, self.odom_frame
        self.features.publish(self.ring.seen_from(self.truth(), self.stamp, self.focal))
        if not is_lost:
            self.odom.publish(odometry)
        self.info.publish(info)


class Recognition:
    """A place recognition of its own, launched as a user would, and all it says."""

    def __init__(self, namespace, **arguments):
        self.namespace = namespace
        self.info = Collector(namespace + '/place_info', PlaceInfo)
        self.signatures = Collector(namespace + '/place_signature', PlaceSignature)
        self.path, self.graph = Collector(namespace + '/map_path', Path), Collector(namespace + '/map_graph', MapGraph)
        self.loops, self.matches = Collector(namespace + '/loops', MarkerArray), Collector(namespace + '/other_matches', PlaceMatch)
        self.rosout = Rosout(namespace)
        arguments = ['%s:=%s' % item for item in arguments.items()] + ['namespace:=' + namespace.strip('/')]
        self.console = tempfile.TemporaryFile('w+')
        self.process = subprocess.Popen(['roslaunch', '--wait', PACKAGE, 'place_recognition.launch'] + arguments, stderr=self.console)

    def inputs(self):
        """Its subscriptions as our end has them."""
        return {('out', '%s/%s' % (self.namespace, topic), self.namespace + '/places_manager')
                for topic in ('stereo_features', 'odom', 'vo_info')}

    def is_connected(self):
        needed = {('out', c.subscriber.resolved_name, rospy.get_name())
                  for c in (self.info, self.signatures, self.path, self.graph, self.loops, self.matches, self.rosout)}
        return (links(self.namespace + '/places_manager') >= needed | {('in', '/tf_static')} and
                links(rospy.get_name()) >= self.inputs())

    def call(self, name, service, *arguments):
        name = '%s/place_recognition/%s' % (self.namespace, name)
        rospy.wait_for_service(name, 20)
        return rospy.ServiceProxy(name, service)(*arguments)

    def close(self, end=signal.SIGINT):
        """Ends the manager by this signal and the launch by Ctrl-C. Returns what the console has."""
        if end != signal.SIGINT:
            os.kill(node_pid(self.namespace + '/places_manager'), end)
            wait_until(lambda: node_pid(self.namespace + '/places_manager') is None, 30)
        self.process.send_signal(signal.SIGINT)
        self.process.wait()
        self.console.seek(0)
        return self.console.read()


class Places(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = temporary_folder(cls)
        cls.clock, cls.ring = SimulatedClock(), Ring()
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform(camera_transform(FRAME))
        cls.tf = Collector('/tf', TFMessage)
        cls.diagnostics = Collector('/diagnostics', DiagnosticArray)

    def start(self, namespace, **arguments):
        recognition = Recognition(namespace, **arguments)
        self.addCleanup(recognition.close)
        return recognition

    def drive(self, robot, recognition, pairs):
        """Returns when each pair has been answered."""
        for _ in range(pairs):
            robot.drive()
            self.assertTrue(wait_until(lambda: recognition.info.has(robot.stamp)),
                            'no answer; errors: %s' % recognition.rosout.errors)
        return recognition.info[-1]

    def transform(self, robot):
        """The newest T_map_odom of a robot on TF; None when there is none."""
        found = transforms_to(robot.odom_frame, self.tf)
        return matrix_of(found[-1].transform) if found else None

    def settle(self, robot):
        """Lets the time pass in which a correction goes into TF."""
        for _ in range(5):
            self.clock.advance_to(self.clock.now + rospy.Duration(1))
            robot.stamp = self.clock.now
            time.sleep(0.15)

    def error(self, robot, T_map_odom, T_world_map):
        """Of the base's position in the map, m."""
        return np.linalg.norm((T_world_map @ T_map_odom @ robot.odometry)[:3, 3] - robot.truth()[:3, 3])

    def test_a_map_is_made_kept_and_shared(self):
        a, b = '/places_a', '/places_b'
        robot = Robot(a, self.ring, self.clock)
        recognition = self.start(a, other=b)
        self.assertTrue(wait_until(recognition.is_connected, 60), 'it did not start')

        # A lap and three pairs: nothing to correct before the start is seen again, then loops.
        away = self.drive(robot, recognition, 20)
        T_world_map = on_the_ring(0)
        self.assertEqual((away.loops, away.places, away.located), (0, 20, True))
        self.assertLess(np.linalg.norm(self.transform(robot) - np.eye(4)), 1e-9)
        info = self.drive(robot, recognition, 14)
        self.assertGreater(info.loops, 2)
        for message in recognition.info:
            if message.same >= 0:
                self.assertLess(abs(message.id - message.same - LAP), 6)
        self.settle(robot)
        drifted = np.linalg.norm((T_world_map @ robot.odometry)[:3, 3] - robot.truth()[:3, 3])
        self.assertGreater(drifted, 1.0)
        self.assertLess(self.error(robot, self.transform(robot), T_world_map), drifted / 4)
        # odom -> base is the odometry's, and nobody else's.
        self.assertEqual({(t.header.frame_id, t.child_frame_id) for m in self.tf for t in m.transforms}, {('map', robot.odom_frame)})

        # The map as messages.
        self.assertTrue(wait_until(lambda: recognition.path and len(recognition.path[-1].poses) == info.places and
                                   recognition.graph and len(recognition.graph[-1].nodes) == info.places))
        path, graph = recognition.path[-1], recognition.graph[-1]
        self.assertEqual((path.header.frame_id, graph.header.frame_id, graph.robot), ('map', 'map', a))
        self.assertEqual([n.stamp for n in graph.nodes], [p.header.stamp for p in path.poses])
        kinds = [edge.kind for edge in graph.edges]
        self.assertEqual((kinds.count('odometry'), kinds.count('loop')), (info.places - 1, info.loops))
        for node, pose in zip(graph.nodes, path.poses):
            self.assertLess(np.linalg.norm(matrix_of(node.pose) - matrix_of(pose.pose) @ OPTICAL), 1e-6)
        self.assertEqual({m.ns for m in recognition.loops[-1].markers if m.points}, {'odometry', 'loop'})
        for signature in recognition.signatures:
            buffer = io.BytesIO()
            signature.serialize(buffer)
            self.assertLessEqual(buffer.tell(), 8192)

        # Kept, and asked for.
        file = os.path.join(self.directory, 'ring.bag')
        answer = recognition.call('save_places', SavePlaces, file)
        self.assertTrue(answer.success, answer.message)
        with rosbag.Bag(file) as bag:
            self.assertEqual(bag.get_message_count(['place']), info.places)
            self.assertEqual(bag.get_message_count(['map_graph']), 1)
        relative = 'sdvo_places_test_%d.bag' % os.getpid()
        self.assertTrue(recognition.call('save_places', SavePlaces, relative).success)
        os.remove(os.path.join(os.environ.get('ROS_HOME', os.path.expanduser('~/.ros')), relative))
        self.assertFalse(recognition.call('load_places', LoadPlaces, os.path.join(self.directory, 'none.bag')).success)
        place = recognition.call('get_place', GetPlace, 3)
        self.assertTrue(place.success)
        self.assertEqual((place.place.id, place.place.robot, len(place.place.features.patches)), (3, a, 0))
        self.assertFalse(recognition.call('get_place', GetPlace, 10000).success)

        self.another_robot_that_does_not_answer(recognition, b)
        self.another_robot_restarted_in_that_map(recognition, b, file)
        self.another_camera(file)
        self.an_odometry_that_is_paused_is_no_fault(robot, recognition)
        self.paused_and_resumed(robot, recognition)
        self.the_odometry_is_lost_and_restarted(robot, recognition)
        self.the_source_restarts(robot, recognition)
        self.the_clock_jumps_back(robot, recognition, file)

    def another_robot_that_does_not_answer(self, recognition, namespace):
        """Nothing waits for it; that it was asked in vain is told with its next key frame."""
        requests = Collector(namespace + '/place_request', PlaceRequest)
        publisher = rospy.Publisher(namespace + '/place_signature', PlaceSignature, queue_size=10)
        manager = recognition.namespace + '/places_manager'
        self.assertTrue(wait_until(lambda: ('out', namespace + '/place_signature', manager) in links(rospy.get_name()) and
                                   ('out', namespace + '/place_request', rospy.get_name()) in links(manager)))
        signature = recognition.signatures[3]
        signature.robot, first = namespace, signature.id

        def is_told():
            publisher.publish(signature)
            time.sleep(0.5)
            signature.id += 1
            return recognition.rosout.warned('gives no answer')
        self.assertTrue(wait_until(is_told), recognition.rosout.warnings)
        self.assertEqual((requests[0].robot, requests[0].id, requests[0].requested_by),
                         (namespace, first, recognition.namespace))
        signature.bits_per_word += 1
        publisher.publish(signature)
        self.assertTrue(wait_until(lambda: recognition.rosout.warned('PlaceSignature message refused')))
        signature.robot = recognition.namespace
        publisher.publish(signature)
        self.assertTrue(wait_until(lambda: recognition.rosout.warned("it has this robot's name")), recognition.rosout.warnings)
        publisher.unregister()
        requests.close()

    def another_robot_restarted_in_that_map(self, recognition, namespace, file):
        """It begins elsewhere and knows where it is when it recognises a place; the first robot learns that it was there."""
        robot = Robot(namespace, self.ring, self.clock, start=10, focal=FOCAL + 1e-9)  # computed anew
        other = self.start(namespace, places_file=file)
        first, manager = recognition.namespace + '/places_manager', namespace + '/places_manager'
        to_the_first = {('out', '%s/%s' % (namespace, topic), first) for topic in ('place_signature', 'place_answer')}
        self.assertTrue(wait_until(lambda: other.is_connected() and to_the_first <= links(manager) and
                                   ('out', namespace + '/place_request', manager) in links(first), 60), 'it did not start')
        robot.drive()
        T_world_odom = robot.truth()
        self.assertTrue(wait_until(lambda: other.info.has(robot.stamp)))
        self.assertEqual((other.info[-1].located, self.transform(robot)), (False, None))
        info = self.drive(robot, other, 5)
        self.assertTrue(info.located)
        self.assertTrue(wait_until(lambda: self.transform(robot) is not None))
        T_world_map = on_the_ring(0)
        self.settle(robot)
        self.assertLess(np.linalg.norm((T_world_map @ self.transform(robot) @ robot.odometry)[:3, 3] - robot.truth()[:3, 3]), 1.0)
        self.assertLess(np.linalg.norm((T_world_map @ self.transform(robot))[:3, 3] - T_world_odom[:3, 3]), 1.0)

        self.assertTrue(wait_until(lambda: len(recognition.matches) >= 3), 'nothing of the other robot was recognised: %s' %
                        recognition.rosout.warnings)
        nodes = {node.id: node for node in recognition.graph[-1].nodes}
        for match in recognition.matches:
            self.assertEqual((match.robot, match.other_robot), (recognition.namespace, namespace))
            pair = round((match.other_stamp - other.info[0].header.stamp).to_sec())
            T_world_mine = T_world_map @ matrix_of(nodes[match.id].pose) @ matrix_of(match.pose.pose) @ np.linalg.inv(OPTICAL)
            self.assertLess(np.linalg.norm(T_world_mine[:3, 3] - on_the_ring(10 + pair)[:3, 3]), 1.0)
        other.close()

    def another_camera(self, file):
        namespace = '/places_c'
        robot = Robot(namespace, self.ring, self.clock, focal=1.1 * FOCAL)
        recognition = self.start(namespace)
        self.assertTrue(wait_until(recognition.is_connected, 60), 'it did not start')
        self.drive(robot, recognition, 2)
        answer = recognition.call('load_places', LoadPlaces, file)
        self.assertFalse(answer.success)
        self.assertIn('another camera', answer.message)
        info = self.drive(robot, recognition, 1)
        self.assertEqual(info.places, 3)
        # Seen before the first pair it is loaded, and then the pairs are refused.
        recognition.close()
        recognition = self.start(namespace, places_file=file)
        self.assertTrue(wait_until(recognition.is_connected, 60), 'it did not start')
        robot.drive()
        self.assertTrue(wait_until(lambda: recognition.rosout.said('another camera')))
        self.assertEqual(len(recognition.info), 0)
        recognition.close()

    def an_odometry_that_is_paused_is_no_fault(self, robot, recognition):
        """Its features come alone."""
        before = recognition.info[-1].unpaired
        for _ in range(3):
            robot.stamp += rospy.Duration(1)
            robot.features.publish(robot.ring.seen_from(robot.truth(), robot.stamp))
        self.assertEqual(self.drive(robot, recognition, 1).unpaired, before)

    def paused_and_resumed(self, robot, recognition):
        self.assertTrue(recognition.call('pause', Trigger).success)
        self.assertTrue(wait_until(lambda: not recognition.inputs() & links(rospy.get_name())))
        answered = len(recognition.info)
        robot.stamp = self.clock.now
        robot.drive()
        self.assertTrue(recognition.call('resume', Trigger).success)
        self.assertTrue(wait_until(recognition.is_connected))
        self.drive(robot, recognition, 1)
        self.assertEqual(len(recognition.info), answered + 1)
        self.assertTrue(wait_until(lambda: 'break' in {edge.kind for edge in recognition.graph[-1].edges}))

    def the_odometry_is_lost_and_restarted(self, robot, recognition):
        """Odom stays where it is in the map until a loop tells."""
        before = recognition.info[-1]
        robot.drive(is_lost=True)
        robot.session, robot.odometry = rospy.Time(8), np.eye(4)
        info = self.drive(robot, recognition, 1)
        self.assertEqual((info.places, info.unpaired), (before.places + 1, before.unpaired))
        self.assertTrue(wait_until(lambda: [edge.kind for edge in recognition.graph[-1].edges].count('break') == 2))
        self.assertLess(np.linalg.norm(matrix_of(info.map_to_odom) - matrix_of(before.map_to_odom)), 1e-6)

    def the_source_restarts(self, robot, recognition):
        """Stamps begin again near zero, the clock goes on: the places stay."""
        before, breaks = recognition.info[-1], [edge.kind for edge in recognition.graph[-1].edges].count('break')
        robot.stamp = rospy.Time(5)
        info = self.drive(robot, recognition, 2)
        self.assertEqual(info.places, before.places + 2)
        self.assertTrue(wait_until(lambda: [e.kind for e in recognition.graph[-1].edges].count('break') == breaks + 1))
        # Odom stays where it is in the map, but for what a loop tells: that of a lost odometry was not known.
        moved = np.linalg.norm(matrix_of(info.map_to_odom) - matrix_of(before.map_to_odom))
        self.assertTrue(moved < 1e-6 or info.loops > before.loops, '%.3f m without a loop' % moved)

    def jump_to(self, stamp, robot, recognition):
        """Returns when the nodelet has the new time: nothing orders the clock and the features."""
        diagnosed, name = len(self.diagnostics), recognition.namespace[1:] + '/'
        self.clock.jump_to(stamp)
        robot.stamp = stamp
        self.assertTrue(wait_until(lambda: any(array.header.stamp == stamp and array.status[0].name.startswith(name)
                                               for array in list(self.diagnostics)[diagnosed:])))

    def the_clock_jumps_back(self, robot, recognition, file):
        self.jump_to(recognition.info[0].header.stamp + rospy.Duration.from_sec(0.5), robot, recognition)
        info = self.drive(robot, recognition, 1)
        self.assertEqual((info.places, info.loops), (1, 0))
        self.assertTrue(wait_until(lambda: recognition.rosout.warned('the clock jumped back')))
        self.assertEqual(len([w for w in recognition.rosout.warnings if 'the clock jumped back' in w]), 1)
        # A map that was loaded stays, and nothing else.
        answer = recognition.call('load_places', LoadPlaces, file)
        self.assertTrue(answer.success, answer.message)
        self.drive(robot, recognition, 2)
        # A stamp that had no answer yet.
        self.jump_to(recognition.info[0].header.stamp + rospy.Duration.from_sec(0.7), robot, recognition)
        info = self.drive(robot, recognition, 1)
        self.assertEqual(info.places, int(answer.message.split()[0]) + 1)
        self.assertEqual(recognition.rosout.errors, [])

    def test_the_end_loses_no_place(self):
        file, other = (os.path.join(self.directory, name) for name in ('site.bag', 'other.bag'))
        namespace, starts = '/places_e', iter(range(1, 99))

        def count(path):
            with rosbag.Bag(path) as bag:
                return bag.get_message_count(['place'])

        saving = os.path.join(self.directory, 'saving.yaml')
        with open(saving, 'w') as config:
            config.write('place_recognition: {save_at_shutdown: true}')

        def run(pairs, act=lambda recognition: None, end=signal.SIGINT):
            robot = Robot(namespace, self.ring, self.clock)
            robot.session = rospy.Time(100 + next(starts))
            recognition = self.start(namespace, places_file=os.path.join(self.directory, '.', 'site.bag'),
                                     config=saving)
            self.assertTrue(wait_until(recognition.is_connected, 60), 'it did not start')
            self.drive(robot, recognition, 2)
            act(recognition)
            self.drive(robot, recognition, pairs)
            return recognition.close(end)

        def save_by_itself(_):
            self.assertTrue(wait_until(lambda: os.path.exists(file), 75), 'nothing was saved while it ran')
            self.assertEqual(count(file), 2)
        # Places left beside, as by a process that was killed while it saved.
        open(file + '.partial-1', 'w').close()
        self.assertIn("saved: 6 places", run(4, save_by_itself))
        self.assertEqual(count(file), 6)
        self.assertEqual([name for name in os.listdir(self.directory) if 'site' in name], ['site.bag'])
        # By systemd or a closed terminal; the same file by another name.
        self.assertIn("saved: ", run(1, lambda recognition: recognition.call('load_places', LoadPlaces, file), signal.SIGTERM))
        self.assertGreater(count(file), 6)
        shutil.copy(file, other)
        kept = count(file)
        for service, arguments in (('reset', (Empty,)), ('load_places', (LoadPlaces, other))):
            self.assertIn("are not saved: '%s' has others, or more" % file,
                          run(8, lambda recognition: recognition.call(service, *arguments)), service)
            self.assertEqual((count(file), count(other)), (kept, kept))
        os.remove(file)
        os.mkdir(file)
        refused = self.start(namespace, places_file=file, config=saving)
        self.assertTrue(wait_until(lambda: refused.rosout.said('it is no regular file'), 60))

    def test_a_reset_takes_the_mount_anew(self):
        self.addCleanup(self.broadcaster.sendTransform, camera_transform(FRAME))
        robot = Robot('/places_d', self.ring, self.clock)
        recognition = self.start('/places_d')
        self.assertTrue(wait_until(recognition.is_connected, 60), 'it did not start')
        self.drive(robot, recognition, 2)
        moved = camera_transform(FRAME)
        moved.transform.translation.z = 0.25
        self.broadcaster.sendTransform(moved)

        def height_after_a_reset():
            robot.epoch, robot.odometry = robot.epoch + 1, np.eye(4)
            info = self.drive(robot, recognition, 1)
            self.assertTrue(wait_until(lambda: recognition.graph and len(recognition.graph[-1].nodes) == info.places))
            return recognition.graph[-1].nodes[-1].pose.position.z
        # Nothing orders the transform and the features.
        self.assertTrue(wait_until(lambda: robot.pair > 12 or abs(height_after_a_reset() - 0.25) < 1e-6))
        self.assertLess(robot.pair, 13, 'a reset keeps the old mount')


if __name__ == '__main__':
    rospy.init_node('places_test')
    rostest.rosrun(PACKAGE, 'places', Places, sys.argv)
