#!/usr/bin/env python3
"""What the launch files set on the parameter server, what they refuse, and what they start again."""

import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xmlrpc.client

import rosbag
import rosgraph
import rosnode
import rospy
import rosservice
import rostest
import yaml
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo

from stereo_descriptor_vo.msg import StereoFeatures, VoInfo

PACKAGE = 'stereo_descriptor_vo'
# Under the nodelets' names; what an argument of the launch file can set.
ARGUMENTS = {'odom_frame_id': 'visual_odometry/odom_frame_id', 'base_frame_id': 'visual_odometry/base_frame_id',
             'initial_pose': 'visual_odometry/initial_pose', 'mask': 'stereo_features/detector/mask',
             'publish_tf': 'visual_odometry/publish_tf', 'approximate_sync': 'stereo_features/approximate_sync',
             'queue_size': 'stereo_features/queue_size', 'odometry_queue_size': 'visual_odometry/queue_size'}
IN_YAML = {'odom_frame_id': 'world', 'base_frame_id': 'robot', 'initial_pose': '1 2 3 0 0 0', 'mask': '/in/yaml.png',
           'publish_tf': False, 'approximate_sync': True,
           'queue_size': 7, 'odometry_queue_size': 8}


def parameters(**arguments):
    """Of stereo_vo.launch, relative to its namespace."""
    command = ['roslaunch', '--dump-params', PACKAGE, 'stereo_vo.launch'] + ['%s:=%s' % item for item in arguments.items()]
    dump = yaml.safe_load(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout) or {}
    return {name[len('/stereo/'):]: value for name, value in dump.items() if name.startswith('/stereo/')}


class Launch(unittest.TestCase):
    def test_without_arguments_nothing_is_set(self):
        self.assertEqual({name: value for name, value in parameters().items() if value != {}}, {})

    def test_arguments_left_alone_leave_the_yaml_file_alone(self):
        with tempfile.NamedTemporaryFile('w', suffix='.yaml') as config:
            nested = {}
            for name, path in ARGUMENTS.items():
                *groups, option = path.split('/')
                block = nested
                for group in groups:
                    block = block.setdefault(group, {})
                block[option] = IN_YAML[name]
            yaml.safe_dump(nested, config)
            config.flush()
            found = parameters(config=config.name)
            self.assertEqual({name: found.get(path) for name, path in ARGUMENTS.items()}, IN_YAML)
            # What is given wins, with its type.
            found = parameters(config=config.name, publish_tf='true', queue_size='30', odom_frame_id='odom_2')
            self.assertEqual([found[ARGUMENTS[name]] for name in ('publish_tf', 'queue_size', 'odom_frame_id')],
                             [True, 30, 'odom_2'])
            self.assertEqual(found[ARGUMENTS['base_frame_id']], 'robot')

    def test_loop_closing_passes_its_arguments_on(self):
        found = parameters(loop_closing='true', map_frame_id='site', publish_map_tf='false', places_file='/site.bag',
                           robot_name='one', places_queue_size='40')
        self.assertEqual({name: value for name, value in found.items() if value != {}},
                         {'place_recognition/' + name: value for name, value in
                          (('map_frame_id', 'site'), ('publish_tf', False), ('places_file', '/site.bag'), ('robot_name', 'one'),
                           ('sync_queue_size', 40), ('queue_size', 40))})

    def test_parameters_of_an_earlier_run_are_forgotten_on_demand(self):
        stale, other = '/stereo/visual_odometry/publish_tf', '/stereo/camera/exposure'
        for clear in ('false', 'true'):
            rospy.set_param(stale, False)
            rospy.set_param(other, 5)
            # Without a manager the nodelets wait: nothing is started.
            process = subprocess.Popen(['roslaunch', '--wait', PACKAGE, 'stereo_vo.launch', 'start_manager:=false',
                                        'base_frame_id:=robot', 'clear_params:=' + clear])
            try:
                end = time.time() + 30
                while not rospy.has_param('/stereo/visual_odometry/base_frame_id') and time.time() < end:
                    time.sleep(0.05)
                self.assertEqual(rospy.get_param('/stereo/visual_odometry/base_frame_id', ''), 'robot')
                self.assertEqual(rospy.has_param(stale), clear == 'false')
                self.assertEqual(rospy.get_param(other), 5)
            finally:
                process.terminate()
                process.wait()
            rospy.delete_param('/stereo')

    def session(self):
        """(session, epoch) of the odometry that answers a message of ours; None where none does."""
        answers = []
        listener = rospy.Subscriber('/stereo/vo_info', VoInfo, lambda info: answers.append((info.session, info.epoch)))
        publisher = rospy.Publisher('/stereo/stereo_features', StereoFeatures, queue_size=1)
        message = StereoFeatures(image_width=640, image_height=480, fx=400.0, fy=400.0, cx=320.0, cy=240.0, baseline=0.1,
                                 descriptor='freak', layout='left+right', element_type='bits', bytes_per_row=128)
        end = time.time() + 30
        while not answers and time.time() < end:
            message.header.stamp = rospy.Time.now()
            publisher.publish(message)
            time.sleep(0.3)
        listener.unregister()
        publisher.unregister()
        return answers[-1] if answers else None

    def test_killed_loaders_and_managers_are_replaced_and_told_apart(self):
        errors, service = [], '/stereo/visual_odometry/reset'
        listener = rospy.Subscriber('/rosout', Log, lambda log: errors.append(log.msg) if log.level >= Log.ERROR else None)
        process = subprocess.Popen(['roslaunch', '--wait', PACKAGE, 'stereo_vo.launch', 'respawn:=true'])

        def is_offered():
            try:
                return rosservice.get_service_node(service) is not None
            except (rosservice.ROSServiceException, rosgraph.network.ROSHandshakeException):
                return False  # it ends while it is asked

        def wait_until(condition):
            end = time.time() + 60
            while not condition() and time.time() < end:
                time.sleep(0.1)
            return condition()
        try:
            self.assertTrue(wait_until(is_offered))
            sessions = [self.session()]
            for node in ('/stereo/visual_odometry', '/stereo/stereo_vo_manager'):
                uri = rosnode.get_api_uri(rosgraph.Master('/test'), node)
                errors.clear()  # that our messages have no transform
                os.kill(xmlrpc.client.ServerProxy(uri).getPid('/test')[2], signal.SIGKILL)
                self.assertTrue(wait_until(lambda: not is_offered()))
                self.assertTrue(wait_until(is_offered))
                self.assertEqual(errors, [], node)
                sessions.append(self.session())
            # The epoch begins at zero with each, so only the session tells them apart.
            self.assertEqual([epoch for _, epoch in sessions], [0, 0, 0])
            self.assertEqual(len({session for session, _ in sessions}), 3)
        finally:
            process.terminate()
            process.wait()
            listener.unregister()

    def test_kitti_launch_fails_for_a_bag_that_cannot_be_read(self):
        with tempfile.TemporaryDirectory() as directory:
            good, bad = os.path.join(directory, 'good.bag'), os.path.join(directory, 'bad.bag')
            with rosbag.Bag(good, 'w') as bag:
                bag.write('/stereo/left/camera_info', CameraInfo(), rospy.Time(1))
            with open(good, 'rb') as whole, open(bad, 'wb') as half:
                half.write(whole.read()[:4200])

            def launch(*arguments):
                return subprocess.run(['roslaunch'] + list(arguments[1:]) + [PACKAGE, 'kitti.launch', 'rviz:=false',
                                                                             'bag:=' + arguments[0]],
                                      cwd=directory, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            outcome = launch(good, '--dump-params')
            self.assertEqual(outcome.returncode, 0, outcome.stderr)
            for bag in (bad, os.path.join(directory, 'missing.bag'), 'good.bag'):  # the player has another directory
                outcome = launch(bag)
                self.assertNotEqual(outcome.returncode, 0, bag)
                self.assertIn(bag.encode(), outcome.stderr)


if __name__ == '__main__':
    rospy.init_node('launch_test')
    rostest.rosrun(PACKAGE, 'launch', Launch, sys.argv)
