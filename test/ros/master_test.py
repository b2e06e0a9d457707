#!/usr/bin/env python3
"""A master that dies while the camera pauses: services answer, and the odometry goes on with the camera."""

import os
import socket
import subprocess
import sys
import threading
import time
import unittest

import rospy
import rostest
import tf2_ros
from dynamic_reconfigure.msg import IntParameter
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty

from kitti_replay import FRAME, PACKAGE, Camera, Collector, links, load_nodelet, nodelet_process, wait_until
from made_up_sequence import MadeUpSequence
from pipeline_case import camera_transform
from stereo_descriptor_vo.srv import SaveTrajectory

PAIRS = 40
PAUSE = 13.0  # s: longer than silence goes unexplained


class SystemClock:
    def advance_to(self, stamp):
        pass


class DeadMaster(unittest.TestCase):
    def test_the_odometry_goes_on_without_a_master(self):
        namespace = '/robot'
        camera = Camera(namespace, MadeUpSequence(PAIRS), SystemClock())
        odometry = Collector(namespace + '/odom', Odometry)
        broadcaster = tf2_ros.StaticTransformBroadcaster()
        broadcaster.sendTransform(camera_transform(FRAME))
        manager = nodelet_process('manager', '__name:=manager', '__ns:=' + namespace)
        self.addCleanup(manager.kill)
        for name, type_name in (('stereo_features', 'StereoFeatures'), ('visual_odometry', 'VisualOdometry')):
            self.assertTrue(load_nodelet(namespace + '/manager', '%s/%s' % (namespace, name), PACKAGE + '/' + type_name))
        self.assertTrue(wait_until(lambda: camera.is_subscribed() and links(namespace + '/manager') >= {
            ('in', '/tf_static'), ('out', namespace + '/odom', rospy.get_name())}, 60))
        begin = time.time()

        def publish():
            """The next pair, stamped by the time that has passed; returns when its pose has come."""
            images, infos = camera.messages(min(len(odometry), PAIRS - 1), time_of=10 * (time.time() - begin))
            camera.publish(images, infos)
            return wait_until(lambda: odometry.has(images[0].header.stamp), 1.0)
        self.assertTrue(wait_until(publish))
        self.assertTrue(publish())

        # Connections that need no master.
        services = {name: rospy.ServiceProxy('%s/visual_odometry/%s' % (namespace, name), service, persistent=True)
                    for name, service in (('reset', Empty), ('set_parameters', Reconfigure), ('save_trajectory', SaveTrajectory))}
        request = ReconfigureRequest()
        calls = [('set_parameters', request), ('save_trajectory', '/no/such/folder/poses.txt', 'tum'), ('reset', )]
        for name, *arguments in calls:
            services[name](*arguments)
        self.assertTrue(wait_until(publish))

        master.kill()
        master.wait()
        request.config.ints = [IntParameter('map/keyframes', 7)]
        answered = []

        def call():
            for name, *arguments in calls:
                services[name](*arguments)
                answered.append(name)
        threading.Thread(target=call, daemon=True).start()
        self.assertTrue(wait_until(lambda: len(answered) == len(calls)), answered)
        time.sleep(PAUSE)
        back = time.time()
        self.assertTrue(wait_until(publish, 10.0), 'no odometry although the camera is back')
        print('odometry %.2f s after the camera was back' % (time.time() - back), flush=True)


if __name__ == '__main__':
    with socket.socket() as free:
        free.bind(('localhost', 0))
        port = str(free.getsockname()[1])
    os.environ['ROS_MASTER_URI'] = 'http://localhost:' + port
    master = subprocess.Popen(['rosmaster', '--core', '-p', port], stdout=subprocess.DEVNULL)
    try:
        end = time.time() + 30
        while time.time() < end:
            try:
                socket.create_connection(('localhost', port)).close()
                break
            except OSError:
                time.sleep(0.1)
        rospy.init_node('master_test')
        rostest.rosrun(PACKAGE, 'master', DeadMaster, sys.argv)
    finally:
        master.kill()
