#!/usr/bin/env python3
"""Sets robot_localization's filter to the odometry's pose wherever that is discontinuous: at each new epoch or session. Fused
poses would be rejected from there on, each as an outlier.
In (under the namespace): vo_info, pose. Out: set_pose, of the filter."""

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped

from stereo_descriptor_vo.msg import VoInfo


class FilterReset:
    def __init__(self):
        self.epoch = self.pose = self.due = None
        self.publisher = rospy.Publisher('set_pose', PoseWithCovarianceStamped, queue_size=1)
        self.subscribers = [rospy.Subscriber('vo_info', VoInfo, self.take_info), rospy.Subscriber('pose', PoseWithCovarianceStamped, self.take_pose)]

    def take_info(self, info):
        epoch = (info.session, info.epoch)
        if self.epoch not in (None, epoch):
            self.due = info.header.stamp
            self.publish()
        self.epoch = epoch

    def take_pose(self, pose):
        self.pose = pose
        self.publish()

    def publish(self):
        """Nothing orders the two topics: the first pose from there on counts."""
        if self.due and self.pose and self.pose.header.stamp >= self.due:
            self.due = None
            self.publisher.publish(self.pose)


if __name__ == '__main__':
    rospy.init_node('filter_reset')
    FilterReset()
    rospy.spin()
