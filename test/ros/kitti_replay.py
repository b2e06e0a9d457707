"""What the ROS tests share: stereo pairs, the pipeline as a user launches it, and the wait for what must happen."""

import copy
import os
import shutil
import subprocess
import tempfile
import time
import unittest
import xmlrpc.client

import cv2
import numpy as np
import rosbag
import rosgraph
import roslib.packages
import rospy
from catkin.find_in_workspaces import find_in_workspaces
from cv_bridge import CvBridge
from nodelet.srv import NodeletList, NodeletLoad
from rosgraph_msgs.msg import Clock, Log
from sensor_msgs.msg import CameraInfo, Image

PACKAGE = 'stereo_descriptor_vo'
FRAME = 'test_left_optical'
EPOCH = 1000.0  # s; ROS reads a stamp of 0 as "no time"


def data_dir(variable, folder):
    """The directory of a data set that has this folder; skips the test, loudly, when there is none."""
    directory = os.environ.get(variable)
    if not directory:
        print('\n*** SKIPPED: %s is not set: give it the absolute path of the data set (with %s) ***\n' % (variable, folder),
              flush=True)
        raise unittest.SkipTest(variable + ' is not set')
    if not os.path.isdir(os.path.join(directory, folder)):
        raise AssertionError("%s = '%s' has no folder '%s'" % (variable, directory, folder))
    return directory


def kitti_dir():
    return data_dir('KITTI_DIR', 'sequences')


def run_tool(name, *arguments):
    executable = roslib.packages.find_node(PACKAGE, name)[0]
    subprocess.run([executable] + list(arguments), check=True, stdout=subprocess.DEVNULL)


def temporary_folder(owner):
    """A folder that a test, or a class of tests, has until its end."""
    directory = tempfile.mkdtemp(prefix='sdvo_')
    (owner.addClassCleanup if isinstance(owner, type) else owner.addCleanup)(shutil.rmtree, directory, ignore_errors=True)
    return directory


def ended_by(test, process):
    """A process that ends with the test at the latest."""
    test.addCleanup(process.wait)
    test.addCleanup(process.terminate)
    return process


def converted(sequence, folder):
    """(bag of a sequence, its true odometry by stamp)."""
    bag = os.path.join(folder, 'sequence.bag')
    run_tool('convert', sequence, '--output', bag)
    with rosbag.Bag(bag) as recorded:
        return bag, {m.header.stamp: m for _, m, _ in recorded.read_messages('/ground_truth/odom')}


def nodelet_process(*arguments):
    """Of the nodelet package, for example a manager."""
    return subprocess.Popen([roslib.packages.find_node('nodelet', 'nodelet')[0], *arguments])


def load_nodelet(manager, name, type_name):
    """Whether the manager has loaded it."""
    load = rospy.ServiceProxy(manager + '/load_nodelet', NodeletLoad)
    load.wait_for_service(60)
    return load(name, type_name, [], [], [], '').success


def street_dir():
    """The rendered street in KITTI layout: 60 pairs, a metre straight ahead from each to the next (target
    stereo_descriptor_vo_street). Where it cannot be rendered, the beginning of KITTI 06, which is much the same; the test is
    skipped, loudly, where there is neither."""
    for directory in find_in_workspaces(['share'], PACKAGE, 'street'):
        if os.path.isfile(os.path.join(directory, 'poses.txt')):
            return directory
    return os.path.join(kitti_dir(), 'sequences', '06')


def wait_until(condition, timeout=30.0):
    """Waits in wall time; true when the condition came to hold."""
    end = time.time() + timeout
    while not condition():
        if time.time() > end or rospy.is_shutdown():
            return bool(condition())
        time.sleep(0.01)
    return True


def links(node):
    """Connections of a node as it sees them itself: ('in', topic) and ('out', topic, name of the other node). Counting
    subscribers at the master, or at this end, is too early: a connection is of use when both ends have it. Empty when the
    node does not answer."""
    try:
        uri = rosgraph.Master('/test').lookupNode(node)
        connections = xmlrpc.client.ServerProxy(uri).getBusInfo('/test')[2]
    except Exception:  # whatever keeps it from answering: it is not there
        return set()
    return {('in', c[4]) if c[2] == 'i' else ('out', c[4], c[1]) for c in connections if c[5]}


def is_connected(node, collectors, inputs=()):
    """Whether a node sends to these collectors of ours and takes in these topics."""
    needed = {('out', c.subscriber.resolved_name, rospy.get_name()) for c in collectors}
    return links(node) >= needed | {('in', topic) for topic in inputs}


def play(bag, *more):
    """A recording that waits for its subscribers, with its clock."""
    subprocess.run(['rosbag', 'play', '--quiet', '--clock', '--wait-for-subscribers', *more, bag], check=True)


def node_pid(node):
    """None when the node does not answer."""
    try:
        uri = rosgraph.Master('/test').lookupNode(node)
        code, _, pid = xmlrpc.client.ServerProxy(uri).getPid('/test')
        return pid if code == 1 else None
    except Exception:  # whatever keeps it from answering: it is not there
        return None


class Collector:
    """Keeps every message of a topic in order."""

    def __init__(self, topic, message_type):
        self.messages = []
        self.subscriber = rospy.Subscriber(topic, message_type, self.messages.append, queue_size=1000)

    def __len__(self):
        return len(self.messages)

    def __getitem__(self, index):
        return self.messages[index]

    def has(self, stamp):
        """Whether a message of this stamp has come."""
        return any(message.header.stamp == stamp for message in list(self.messages))

    def close(self):
        self.subscriber.unregister()


class StereoSequence:
    """The first pairs of the street in memory."""

    def __init__(self, count):
        directory = street_dir()
        paths = [[os.path.join(directory, 'image_%d' % side, '%06d.png' % i) for side in range(2)]
                 for i in range(count)]
        self.pairs = [[cv2.imread(path, cv2.IMREAD_GRAYSCALE) for path in pair] for pair in paths]
        assert all(image is not None for pair in self.pairs for image in pair), 'cannot read images in ' + directory
        with open(os.path.join(directory, 'calib.txt')) as file:
            rows = dict(line.split(':') for line in file if line.strip())
        self.projections = [[float(x) for x in rows['P%d' % side].split()] for side in range(2)]

    def scaled(self, factor):
        """The same as a camera with more or fewer pixels would see it."""
        other = copy.copy(self)
        other.pairs = [[cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA) for image in pair]
                       for pair in self.pairs]
        other.projections = [[factor * p if k < 8 else p for k, p in enumerate(row)] for row in self.projections]
        return other

    def camera_info(self, side):
        p = self.projections[side]
        info = CameraInfo()
        info.height, info.width = self.pairs[0][side].shape
        info.distortion_model = 'plumb_bob'
        info.D = [0.0] * 5
        info.K = [p[0], 0, p[2], 0, p[5], p[6], 0, 0, 1]
        info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        info.P = p
        return info


class Camera:
    """A stereo camera's driver: publishes pairs and, as the only source of it, the simulated time."""

    def __init__(self, namespace, sequence, clock):
        self.sequence, self.clock = sequence, clock
        self.bridge = CvBridge()
        sides = ['left', 'right']
        self.images = [rospy.Publisher('%s/%s/image_rect' % (namespace, s), Image, queue_size=100) for s in sides]
        self.infos = [rospy.Publisher('%s/%s/camera_info' % (namespace, s), CameraInfo, queue_size=100) for s in sides]

    def is_subscribed(self):
        return all(p.get_num_connections() > 0 for p in self.images + self.infos)

    def has_subscribers(self):
        return any(p.get_num_connections() > 0 for p in self.images + self.infos)

    def messages(self, i, time_of=None, frame=FRAME):
        """([left image, right image], [left info, right info]) of pair i, stamped as pair `time_of` of a 10 Hz camera."""
        stamp = rospy.Time.from_sec(EPOCH) + rospy.Duration.from_sec(0.1 * (i if time_of is None else time_of))
        images = [self.bridge.cv2_to_imgmsg(image, 'mono8') for image in self.sequence.pairs[i]]
        infos = [self.sequence.camera_info(side) for side in range(2)]
        for message in images + infos:
            message.header.stamp = stamp
            message.header.frame_id = frame
        return images, infos

    def dark(self, i, **options):
        """As messages(), of a lens that is covered."""
        images, infos = self.messages(i, **options)
        for image in images:
            image.data = bytes(len(image.data))
        return images, infos

    def publish(self, images, infos):
        self.clock.advance_to(images[0].header.stamp)
        self.send(images, infos)

    def send(self, images, infos):
        """Whatever time it is."""
        for publisher, message in zip(self.infos + self.images, infos + images):
            publisher.publish(message)

    def close(self):
        for publisher in self.images + self.infos:
            publisher.unregister()


class SimulatedClock:
    """Runs ahead only, while the stamps of the images may jump."""

    def __init__(self):
        self.now = rospy.Time.from_sec(EPOCH)
        self.publisher = rospy.Publisher('/clock', Clock, queue_size=10, latch=True)
        self.publish()

    def publish(self):
        self.publisher.publish(Clock(clock=self.now))

    def advance_to(self, stamp):
        if stamp > self.now:
            self.now = stamp
        self.publish()

    def jump_to(self, stamp):
        """As when a bag is started again."""
        self.now = stamp
        self.publish()


class Pipeline:
    """The two nodelets, launched as a user would."""

    def __init__(self, namespace, launch='stereo_vo.launch', **arguments):
        self.namespace = namespace
        self.manager = arguments.get('manager', namespace + '/stereo_vo_manager')
        arguments = ['%s:=%s' % item for item in arguments.items()] + ['namespace:=' + namespace.strip('/')]
        self.process = subprocess.Popen(['roslaunch', '--wait', PACKAGE, launch] + arguments)

    def is_connected(self, listeners):
        """Whether the manager sends this node each topic of the collectors given, and its errors, and has its own inputs."""
        needed = {('out', topic, rospy.get_name()) for topic in [c.subscriber.resolved_name for c in listeners] + ['/rosout']}
        inputs = ('stereo_features', 'left/image_rect', 'right/image_rect', 'left/camera_info', 'right/camera_info')
        needed |= {('in', '%s/%s' % (self.namespace, topic)) for topic in inputs}
        return links(self.manager) >= needed | {('in', '/tf_static')}

    def has_loaded(self, *names):
        """Whether these nodelets are in the manager and have subscribed all: two of them share what goes in."""
        try:
            loaded = rospy.ServiceProxy(self.manager + '/list', NodeletList)().nodelets
        except (rospy.ServiceException, rospy.exceptions.TransportException):
            return False  # it is not there yet
        return all('%s/%s' % (self.namespace, name) in loaded for name in names)

    def pid(self):
        """Of the nodelet manager; None when it is gone."""
        return node_pid(self.manager)

    def close(self):
        self.process.terminate()
        self.process.wait()


class Rosout:
    """Warnings, and errors and fatal messages, that nodes of a namespace log."""

    def __init__(self, namespace):
        self.namespace = namespace
        self.errors, self.warnings, self.files = [], [], set()
        self.subscriber = rospy.Subscriber('/rosout', Log, self.receive, queue_size=1000)

    def receive(self, log):
        if log.name.startswith(self.namespace + '/') and log.level >= Log.WARN:
            (self.errors if log.level >= Log.ERROR else self.warnings).append(log.msg)
            self.files.add(os.path.basename(log.file))

    def said(self, *words):
        return any(all(word in error for word in words) for error in self.errors)

    def warned(self, *words):
        return any(all(word in warning for word in words) for warning in self.warnings)

    def close(self):
        self.subscriber.unregister()


def transforms_to(child, messages):
    """All that came on /tf of a child frame."""
    return [t for message in list(messages) for t in message.transforms if t.child_frame_id == child]


def matrix_of(pose):
    """4x4 matrix of a geometry_msgs/Pose or Transform."""
    t = pose.position if hasattr(pose, 'position') else pose.translation
    q = pose.orientation if hasattr(pose, 'orientation') else pose.rotation
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), t.x],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), t.y],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), t.z],
                     [0, 0, 0, 1]])
