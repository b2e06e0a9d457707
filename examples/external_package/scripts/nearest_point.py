#!/usr/bin/env python3
"""Features of a pair with its pose: publishes ~depth, the depth of the nearest feature in m. The three messages of a pair have one
stamp. A pair without a pose (LOST) has no odom, so it is left out."""

import message_filters
import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32

from stereo_descriptor_vo.msg import StereoFeatures, VoInfo

QUEUE = 30  # pairs: odom follows its features by some milliseconds


def main():
    rospy.init_node('nearest_point')
    publisher = rospy.Publisher('~depth', Float32, queue_size=10)

    def take(features, odom, info):
        depth = features.fx * features.baseline / max(features.disparity) if features.disparity else float('inf')
        publisher.publish(depth)
        position = odom.pose.pose.position
        rospy.loginfo_throttle(1.0, '%s, epoch %d: at (%.2f, %.2f, %.2f) the nearest of %d features is %.2f m away' % (
            info.state, info.epoch, position.x, position.y, position.z, len(features.u), depth))

    pairs = message_filters.TimeSynchronizer([message_filters.Subscriber('stereo_features', StereoFeatures, queue_size=QUEUE),
                                              message_filters.Subscriber('odom', Odometry, queue_size=QUEUE),
                                              message_filters.Subscriber('vo_info', VoInfo, queue_size=QUEUE)], QUEUE)
    pairs.registerCallback(take)
    rospy.spin()


if __name__ == '__main__':
    main()
