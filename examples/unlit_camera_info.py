#!/usr/bin/env python3
"""camera_info of the pairs of a RealSense D400 that its projector does not light, where that is on in every second pair
(emitter_on_off). A pair needs its camera_info, so lit pairs are left out: realsense_d400.launch emitter_on_off:=true.

In: camera_info and metadata (realsense2_camera/Metadata) of one side. Out: unlit/camera_info.
~inverted: true where the metadata are those of the other pairs, as some firmware has it."""

import collections
import json
import threading

import genpy.dynamic
import rospy
from sensor_msgs.msg import CameraInfo

WAITING = 30  # messages of either topic; a second
POWERS = ('frame_laser_power', 'frame_emitter_mode', 'frame_laser_power_mode')  # 0: off


class UnlitCameraInfo:
    def __init__(self):
        self.inverted = rospy.get_param('~inverted', False)
        self.lock = threading.Lock()
        self.infos, self.are_lit = collections.OrderedDict(), collections.OrderedDict()  # by stamp
        self.types = {}
        self.publisher = rospy.Publisher('unlit/camera_info', CameraInfo, queue_size=WAITING)
        self.subscribers = [rospy.Subscriber('camera_info', CameraInfo, self.on_info, queue_size=WAITING),
                            rospy.Subscriber('metadata', rospy.AnyMsg, self.on_metadata, queue_size=WAITING)]

    def on_info(self, info):
        self.add(self.infos, info.header.stamp, info)

    def on_metadata(self, any_message):
        """By the definition that comes with the connection: the driver's package need not be installed here."""
        connection = any_message._connection_header
        if connection['type'] not in self.types:
            self.types.update(genpy.dynamic.generate_dynamic(connection['type'], connection['message_definition']))
        message = self.types[connection['type']]().deserialize(any_message._buff)
        metadata = json.loads(message.json_data)
        powers = [metadata[name] for name in POWERS if name in metadata]
        if not powers:
            rospy.logerr_throttle(10, 'no pair is used: %s has none of %s; the kernel needs librealsense\'s patches for metadata' %
                                  (self.subscribers[1].resolved_name, ', '.join(POWERS)))
            return
        self.add(self.are_lit, message.header.stamp, (float(powers[0]) > 0) != self.inverted)

    def add(self, waiting, stamp, value):
        with self.lock:
            waiting[stamp] = value
            if stamp in self.infos and stamp in self.are_lit:
                info = self.infos.pop(stamp)
                if not self.are_lit.pop(stamp):
                    self.publisher.publish(info)
            while len(waiting) > WAITING:
                waiting.popitem(last=False)


if __name__ == '__main__':
    rospy.init_node('unlit_camera_info')
    node = UnlitCameraInfo()
    rospy.spin()
