#!/usr/bin/env python3
"""Subscribes to descriptors in Python: rows, left and right halves, points. Publishes for each message with features

~half_distance  std_msgs/Float32, median share of bits in which the two halves of a row differ (binary descriptors)
~median_depth   std_msgs/Float32, median depth of the features, m
"""

import numpy as np
import rospy
from std_msgs.msg import Float32

from stereo_descriptor_vo.msg import StereoFeatures

DTYPES = {'bits': np.uint8, 'uint8': np.uint8, 'float32': np.dtype('<f4')}


def descriptor_rows(message):
    """One row for each feature, without a copy. Raises ValueError when the lengths do not fit."""
    rows = np.frombuffer(message.descriptors, np.uint8).reshape(len(message.u), message.bytes_per_row)
    return rows.view(DTYPES[message.element_type])


def points(message):
    """Positions in the left rectified optical frame (x right, y down, z forward), m, one row for each feature."""
    u, v, disparity = (np.array(a) for a in (message.u, message.v, message.disparity))
    z = message.fx * message.baseline / disparity
    return np.column_stack(((u - message.cx) * z / message.fx, (v - message.cy) * z / message.fy, z))


class DescriptorListener:
    def __init__(self):
        self.half_distance = rospy.Publisher('~half_distance', Float32, queue_size=10)
        self.median_depth = rospy.Publisher('~median_depth', Float32, queue_size=10)
        self.subscriber = rospy.Subscriber('stereo_features', StereoFeatures, self.receive, queue_size=10)

    def receive(self, message):
        if not message.u:
            return
        try:
            rows, depth = descriptor_rows(message), points(message)[:, 2]
        except (KeyError, ValueError) as error:
            rospy.logerr_throttle(5.0, 'StereoFeatures message refused: %s' % error)
            return
        self.median_depth.publish(np.median(depth))
        if message.layout == 'left+right' and message.element_type == 'bits':
            left, right = np.hsplit(rows, 2)
            self.half_distance.publish(np.median(np.unpackbits(left ^ right, axis=1).mean(axis=1)))


if __name__ == '__main__':
    rospy.init_node('descriptor_listener')
    DescriptorListener()
    rospy.spin()
