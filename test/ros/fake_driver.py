"""Drivers of stereo cameras, as their topics look: rendered pairs under each driver's names, frames and camera_info habits."""

import dataclasses
import json

import cv2
import genpy.dynamic
import numpy as np
import rospy
import tf2_ros
from cv_bridge import CvBridge
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, Image

DEVICE_CLOCK = 1000.0  # s; far from the system's

# The message of realsense2_camera 2.3, whose package need not be there.
METADATA = 'realsense2_camera/Metadata'
Metadata = genpy.dynamic.generate_dynamic(METADATA, """std_msgs/Header header
string json_data
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
""")[METADATA]

# Lenses of raw images: coefficients in the order of their model.
LENSES = {'plumb_bob': [-0.2, 0.05, 0.001, -0.001, 0.0],
          'rational_polynomial': [0.4, 0.02, 0.0005, -0.0005, 0.001, 0.6, 0.05, 0.001],
          'equidistant': [-0.02, 0.01, -0.004, 0.001]}


@dataclasses.dataclass
class Habits:
    """What a driver calls its topics (under its namespace) and frames, and what it writes into camera_info."""
    launch: str
    namespace: str
    sides: tuple
    image: str
    frames: tuple  # of the left and the right image
    root: str = ''  # frame from which the driver publishes TF to the optical frames; empty: it publishes none
    model: str = 'plumb_bob'
    encoding: str = 'mono8'
    raw: bool = False
    reversed_pair: bool = False  # Tx in the left camera_info, not in the right one
    without_tx: bool = False
    emitter: str = 'off'  # or 'on'; 'on_off': dots in every second pair, from the second one on, as the left side's metadata tell


REALSENSE = Habits('realsense_d400.launch', 'camera', ('infra1', 'infra2'), 'image_rect_raw',
                   ('camera_infra1_optical_frame', 'camera_infra2_optical_frame'), 'camera_link')
OAK = Habits('oak_d.launch', 'oak', ('left', 'right'), 'image_raw',
             ('oak_left_camera_optical_frame', 'oak_right_camera_optical_frame'), 'oak-d-base-frame', model='rational_polynomial')
ZED = Habits('zed.launch', 'zed2', ('zed_node/left', 'zed_node/right'), 'image_rect_gray',
             ('zed2_left_camera_optical_frame', 'zed2_right_camera_optical_frame'), 'base_link')
TWO = Habits('two_cameras.launch', 'stereo', ('left', 'right'), 'image_raw', ('left_optical', 'right_optical'),
             encoding='bgr8', raw=True)


def raw_map(model, k, size):
    """Where each pixel of a raw image lies in the rectified one, whose K is the same."""
    width, height = size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).reshape(-1, 1, 2).astype(np.float64)
    undistort = cv2.fisheye.undistortPoints if model == 'equidistant' else cv2.undistortPoints
    return undistort(pixels, k, np.array(LENSES[model]), P=k).reshape(height, width, 2).astype(np.float32)


class FakeDriver:
    """Publishes pairs of a kitti_replay.StereoSequence."""

    def __init__(self, habits, sequence):
        self.habits, self.sequence, self.bridge = habits, sequence, CvBridge()
        names = ['/%s/%s/' % (habits.namespace, side) for side in habits.sides]
        self.images = [rospy.Publisher(name + habits.image, Image, queue_size=100) for name in names]
        self.infos = [rospy.Publisher(name + 'camera_info', CameraInfo, queue_size=100) for name in names]
        self.metadata = rospy.Publisher(names[0] + 'metadata', Metadata, queue_size=100) if habits.emitter == 'on_off' else None
        dots = np.random.default_rng(1).random(sequence.pairs[0][0].shape) < 0.01
        self.dots = 100 * cv2.dilate(np.uint8(dots), np.ones((2, 2), np.uint8))  # grey levels
        p = sequence.projections[0]
        k = np.array([[p[0], 0, p[2]], [0, p[5], p[6]], [0, 0, 1.0]])
        self.map = raw_map(habits.model, k, sequence.pairs[0][0].shape[::-1]) if habits.raw else None
        if habits.root:
            self.broadcaster = tf2_ros.StaticTransformBroadcaster()
            self.broadcaster.sendTransform([self.transform(frame) for frame in habits.frames])

    def transform(self, frame):
        """An optical frame at the driver's root; where the right camera is plays no part."""
        transform = TransformStamped()
        transform.header.frame_id, transform.child_frame_id = self.habits.root, frame
        q = transform.transform.rotation
        q.x, q.y, q.z, q.w = -0.5, 0.5, -0.5, 0.5
        return transform

    def topics(self):
        return [publisher.resolved_name for publisher in self.images + self.infos]

    def is_subscribed(self):
        publishers = self.images + self.infos + [self.metadata] * (self.metadata is not None)
        return all(publisher.get_num_connections() > 0 for publisher in publishers)

    def info(self, side):
        info = self.sequence.camera_info(side)
        info.distortion_model = self.habits.model
        info.D = LENSES[self.habits.model] if self.habits.raw else [0.0] * len(LENSES[self.habits.model])
        p = list(info.P)
        if self.habits.without_tx:
            p[3] = 0.0
        elif self.habits.reversed_pair:
            p[3] = self.sequence.projections[1 - side][3]
        info.P = p
        return info

    def image(self, i, side):
        image = self.sequence.pairs[i][side]
        if self.is_lit(i):
            image = cv2.add(image, self.dots)
        if self.map is not None:
            image = cv2.remap(image, self.map, None, cv2.INTER_LINEAR)
        if self.habits.encoding == 'bgr8':
            image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
        return self.bridge.cv2_to_imgmsg(image, self.habits.encoding)

    def is_lit(self, i):
        return self.habits.emitter == 'on' or self.habits.emitter == 'on_off' and i % 2 == 1

    def publish(self, i):
        """Pair i of a 10 Hz camera; returns its stamp."""
        stamp = rospy.Time.from_sec(DEVICE_CLOCK) + rospy.Duration.from_sec(0.1 * i)
        for side in range(2):
            for publisher, message in ((self.infos[side], self.info(side)), (self.images[side], self.image(i, side))):
                message.header.stamp, message.header.frame_id = stamp, self.habits.frames[side]
                publisher.publish(message)
        if self.metadata:
            metadata = Metadata(json_data=json.dumps({'frame_number': i, 'frame_laser_power': 150 * self.is_lit(i)}))
            metadata.header.stamp = stamp
            self.metadata.publish(metadata)
        return stamp

    def close(self):
        for publisher in self.images + self.infos + [self.metadata] * bool(self.metadata):
            publisher.unregister()
