#!/usr/bin/env python3
"""What the launch files set on the parameter server, what they refuse, and what they start again."""

import glob
import os
import pathlib
import shlex
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree
from unittest import mock

import rosbag
import rosgraph
import roslaunch.config
import roslib.packages
import rospy
import rosservice
import rostest
import yaml
from nodelet.srv import NodeletList
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from kitti_replay import PACKAGE, ended_by, node_pid, nodelet_process, wait_until
from stereo_descriptor_vo.msg import StereoFeatures, VoInfo

# Under the nodelets' names; what an argument of the launch file can set.
ARGUMENTS = {'odom_frame_id': 'visual_odometry/odom_frame_id', 'base_frame_id': 'visual_odometry/base_frame_id',
             'publish_tf': 'visual_odometry/publish_tf', 'use_imu': 'visual_odometry/use_imu', 'guess_frame_id': 'visual_odometry/guess_frame_id',
             'planar': 'visual_odometry/planar', 'approximate_sync': 'stereo_features/approximate_sync',
             'image_transport': 'stereo_features/image_transport', 'queue_size': 'stereo_features/queue_size'}
IN_YAML = {'odom_frame_id': 'world', 'base_frame_id': 'robot', 'publish_tf': False, 'use_imu': True, 'guess_frame_id': 'wheel_odom',
           'planar': True, 'approximate_sync': True, 'image_transport': 'compressed', 'queue_size': 7}


FOLDER = os.path.join(roslib.packages.get_pkg_dir(PACKAGE), 'launch')


def load(file, **arguments):
    """A launch file, or a text of one, as it is read, without the parameters of ROS itself."""
    given = ['%s:=%s' % item for item in arguments.items()]
    texts, files = ([file], []) if file.startswith('<') else (None, [(os.path.join(FOLDER, file), given)])
    config = roslaunch.config.load_config_default(files, None, roslaunch_strs=texts)
    config.params = {name: p.value for name, p in config.params.items() if name not in ('/rosdistro', '/rosversion')}
    return config


def nodes(config):
    return {node.namespace + node.name: node for node in config.nodes}


def launch_files():
    return [os.path.relpath(os.path.join(folder, file), FOLDER)
            for folder, _, files in os.walk(FOLDER) for file in files if file.endswith('.launch')]


def arguments_of(file):
    """Attributes of the arguments that a user may give, by name."""
    root = xml.etree.ElementTree.parse(os.path.join(FOLDER, file)).getroot()
    return {arg.get('name'): arg.attrib for arg in root.findall('arg') if arg.get('value') is None}


def parameters(**arguments):
    """Of stereo_vo.launch, relative to its namespace."""
    command = ['roslaunch', '--dump-params', PACKAGE, 'stereo_vo.launch'] + ['%s:=%s' % item for item in arguments.items()]
    dump = yaml.safe_load(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout) or {}
    return {name[len('/stereo/'):]: value for name, value in dump.items() if name.startswith('/stereo/')}


def roslaunch_of(test, *arguments, **options):
    """Runs until the test's end at the latest."""
    return ended_by(test, subprocess.Popen(['roslaunch', '--wait', PACKAGE] + list(arguments), universal_newlines=True, **options))


def refusal(*arguments):
    """Of a command line with stereo_vo.launch."""
    command = ['roslaunch', '--dump-params', PACKAGE, 'stereo_vo.launch'] + list(arguments)
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, universal_newlines=True).stderr


class Launch(unittest.TestCase):
    def test_including_files_have_all_arguments_of_the_inner_ones(self):
        for file in launch_files():
            root = xml.etree.ElementTree.parse(os.path.join(FOLDER, file)).getroot()
            outer = arguments_of(file)
            for include in root.iter('include'):
                inner = arguments_of(include.get('file').replace('$(find %s)/launch/' % PACKAGE, ''))
                set_here = {arg.get('name') for arg in include.findall('arg')}
                what = '%s includes %s' % (file, include.get('file'))
                self.assertEqual(include.get('pass_all_args'), 'true', what)
                self.assertEqual(set(inner) - set_here - set(outer), set(), what)
                for name in set(inner) & set(outer) - set_here:
                    # Another default than the inner one has a word about it.
                    if 'doc' not in outer[name] and 'default' in inner[name]:
                        self.assertEqual(outer[name]['default'], inner[name]['default'], '%s: %s' % (what, name))

    def test_parameters_that_users_change_first_are_arguments_or_named(self):
        with open(os.path.join(FOLDER, '..', 'docs', 'parameters.md')) as text:
            first = text.read().split('\n| --- |')[1].split('\n\n')[0]
        names = [line.split('`')[1].split('/')[-1] for line in first.splitlines() if '`' in line]
        self.assertEqual(len(names), 10)
        for name in set(names) - set(arguments_of('stereo_vo.launch')):
            self.assertIn(': in the file of config:= it is ', refusal(name + ':=1'))

    def test_arguments_are_few(self):
        self.assertEqual({file: len(arguments_of(file)) for file in launch_files() if len(arguments_of(file)) > 25}, {})

    def test_a_drive_is_recorded_on_request_alone(self):
        self.assertNotIn('/stereo/recorder', nodes(load('stereo_vo.launch')))
        for file in ('stereo_vo.launch', 'stereo_raw.launch', 'cameras/oak_d.launch', 'mavros.launch'):
            recorders = [node for node in load(file, record='/tmp/drive.bag').nodes if node.type == 'record']
            self.assertEqual([recorder.args for recorder in recorders], ['-O "/tmp/drive.bag" /tf /tf_static odom vo_info'], file)

    def test_what_is_recorded_is_what_is_used_under_a_name_of_its_own(self):
        """With a stand-in for rosbag's recorder."""
        topics = ['/cam/left/image_rect_raw/compressed', '/cam/right/image_rect_raw/compressed', '/cam/left/camera_info',
                  '/cam/right/camera_info']
        with tempfile.TemporaryDirectory() as home:
            environment = dict(os.environ, HOME=home, ROS_NAMESPACE='/recorded')

            def record(path, **options):
                return subprocess.Popen(['sh', os.path.join(FOLDER, 'ros_python'), os.path.join(FOLDER, 'record_drive.py'), 'stereo_features',
                                         '/bin/echo', '-O', path, '/tf', 'odom', 'vo_info', 'odom:=/robot/odom'], env=environment, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, universal_newlines=True, **options)
            waiting = record('~/drive.bag')
            self.addCleanup(rospy.delete_param, '/recorded')
            rospy.set_param('/recorded/stereo_features/input_topics', topics)
            time.sleep(2)
            self.assertIsNone(waiting.poll(), 'there are no images')
            publishers = [rospy.Publisher(topic, CompressedImage, queue_size=1) for topic in topics[:2]]
            self.assertEqual(waiting.communicate(timeout=20)[0].split(), ['-O', home + '/drive.bag', '/tf', '/robot/odom', '/recorded/vo_info', 'odom:=/robot/odom'] + topics,
                             'names of a bag are those of its topics')
            for there, expected in (('drive.bag', 'drive_2.bag'), ('drive_2.bag.active', 'drive_3.bag')):  # a killed recorder's
                open(os.path.join(home, there), 'w').close()
                said, warned = record('~/drive').communicate(timeout=20)
                self.assertIn(' %s/%s ' % (home, expected), said)
                self.assertIn('[ WARN] an older drive has the name asked for: recording to %s/%s ' % (home, expected), warned)
            refused = record(home + '/missing/drive.bag')
            self.assertIn('[ERROR] nothing is recorded: there is no folder %s/missing' % home, refused.communicate(timeout=20)[1])
            self.assertEqual(refused.returncode, 1)
            for publisher in publishers:
                publisher.unregister()

    def test_what_has_no_effect_in_a_yaml_file_is_named(self):
        def copy(text):
            with tempfile.TemporaryDirectory() as folder:
                path = os.path.join(folder, 'mine.yaml')
                with open(path, 'w') as file:
                    file.write(text)
                return subprocess.run([sys.executable, os.path.join(FOLDER, 'copy_config.py'), path, path + '.copy'], stderr=subprocess.PIPE,
                                      universal_newlines=True)
        for text, said in (('max_features: 5', 'max_features is of no nodelet here'), ('stereo: {stereo_features: {}}', 'stereo is of no nodelet here'),
                           ('stereo_feature: {}', 'stereo_feature is of no nodelet here'),
                           ('visual_odometry: {planar: true,\n  planar: false}', 'line 2: planar is there twice, the last one holds')):
            outcome = copy(text)
            self.assertIn('mine.yaml: ' + said, outcome.stderr)
            self.assertEqual(outcome.returncode, 0, outcome.stderr)
        self.assertEqual(copy('stereo_features: {detector: {max_features: 5}}\nplace_recognition:\n').stderr, '')
        for text, said in (('stereo_features: {max_rate: 99999999999}', 'stereo_features/max_rate = 99999999999 does not fit into 32 bits'),
                           ('visual_odometry: {a: 2026-01-01}', 'visual_odometry/a = 2026-01-01 is a date: quote it'),
                           ('visual_odometry: {1: 2}', 'visual_odometry/1 is no name: quote it')):
            outcome = copy(text)
            self.assertEqual((outcome.returncode, outcome.stderr.count('\n')), (1, 1), outcome.stderr)
            self.assertIn('mine.yaml: ' + said, outcome.stderr)

    def test_options_end_with_their_launch(self):
        for file in launch_files():
            for node in xml.etree.ElementTree.parse(os.path.join(FOLDER, file)).getroot().iter('node'):
                if 'load stereo_descriptor_vo' in node.get('args', '') and node.get('launch-prefix'):
                    self.assertEqual(node.get('clear_params'), 'true', '%s: %s' % (file, node.get('name')))

    def test_a_python_without_ros_modules_may_come_first_on_path(self):
        with tempfile.TemporaryDirectory() as folder:
            python, config = os.path.join(folder, 'python3'), os.path.join(folder, 'config.yaml')
            with open(python, 'w') as file:
                file.write('#!/bin/sh\nexec /usr/bin/python3 -I -S "$@"\n')
            os.chmod(python, 0o755)
            with open(config, 'w') as file:
                file.write('visual_odometry: {map: {keyframes: 7}}')
            with mock.patch.dict(os.environ, PATH=folder + ':' + os.environ['PATH']):
                self.assertEqual(parameters(config=config), {'visual_odometry/map/keyframes': 7})
                process = roslaunch_of(self, 'stereo_vo.launch', 'record:=/missing/drive.bag', stderr=subprocess.PIPE)
            self.assertIsNotNone(self.session())
            process.terminate()
            said = process.communicate()[1]
            self.assertIn('nothing is recorded: there is no folder /missing', said)
            self.assertNotIn('Traceback', said)

    def test_a_filter_that_publishes_tf_gets_all_of_it(self):
        for file in ('stereo_vo.launch', 'stereo_raw.launch', 'mavros.launch', 'cameras/oak_d.launch'):
            for both, in_yaml, expected in (('false', None, False), ('false', True, True), ('true', None, True)):
                with tempfile.NamedTemporaryFile('w', suffix='.yaml') as config:
                    yaml.safe_dump({'place_recognition': {'publish_tf': in_yaml}}, config)
                    config.flush()
                    found = load(file, loop_closing='true', publish_tf=both, config=config.name).params
                self.assertEqual(found['/%s/place_recognition/publish_tf' % ('oak' if 'oak' in file else 'stereo')], expected, (file, in_yaml))

    def test_rviz_on_demand(self):
        for file in ('stereo_vo.launch', 'mavros.launch', 'cameras/zed.launch'):
            self.assertEqual([name for name in nodes(load(file)) if 'rviz' in name], [])
            for view, expected in (('true', 'places'), ('example_robot', 'example_robot')):
                found = load(file, rviz=view, namespace='front', loop_closing='true', map_frame_id='site')
                rviz = nodes(found)['/front/rviz']
                self.assertTrue(rviz.args.endswith('/%s.rviz" -f site' % expected), rviz.args)

    def test_the_transport_of_raw_images_is_not_that_of_rectified_ones(self):
        found = load('stereo_raw.launch', image_transport='compressed').params
        self.assertEqual(sorted(name for name in found if name.endswith('image_transport')),
                         ['/stereo/left_debayer/image_transport', '/stereo/right_debayer/image_transport'])

    def test_a_group_keeps_all_its_names_to_itself(self):
        found = nodes(load('<launch><group ns="uav1"><include file="$(find %s)/launch/mavros.launch">'
                           '<arg name="mavros" value="/uav1/mavros"/><arg name="loop_closing" value="true"/>'
                           '</include></group></launch>' % PACKAGE))
        for node in ('visual_odometry', 'place_recognition'):
            self.assertIn(['odom', '/uav1/mavros/odometry/out'], found['/uav1/stereo/' + node].remap_args)

    def test_a_mount_is_published_where_it_is_given(self):
        for file, needed in (('oak_d', {}), ('realsense_d400', {}), ('two_cameras', {}),
                             ('side_by_side', {'left_info': '/left.yaml', 'right_info': '/right.yaml'})):
            def publishers(**arguments):
                config = load('cameras/%s.launch' % file, **needed, **arguments)
                return sorted(node.args for node in config.nodes if node.type == 'static_transform_publisher')
            self.assertEqual(publishers(), [])
            self.assertEqual(publishers(base_frame_id='camera_link', namespace='camera'), [])
            # In URDF's order, as initial_pose has it; the publisher's is the other one.
            given = publishers(mount_rpy='1 2 3 0.1 0.2 0.3')
            self.assertTrue(given and given[-1].startswith('1 2 3 0.3 0.2 0.1 base_link '), given)
            self.assertTrue(publishers(mount_rpy='0 0 0 0 0 0 1')[-1].startswith('mount_rpy_needs_six_numbers '))
        same = load('cameras/realsense_d400.launch', mount_rpy='0 0 0 0 0 0', base_frame_id='camera_link')
        self.assertEqual([node for node in same.nodes if node.name == 'camera_mount'], [])

    def test_blocks_and_values_that_are_left_empty_are_none(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'my config.yaml')
            for text, expected in (('stereo_features:\nvisual_odometry:\n  tracking: {max_speed: 3}\n',
                                    {'/stereo/visual_odometry/tracking/max_speed': 3}),
                                   ('stereo_features:\n  detector:\n    max_features:\n    min_spacing: 4.0\n',
                                    {'/stereo/stereo_features/detector/min_spacing': 4.0}), ('', {}), ('# none\n', {})):
                with open(path, 'w') as config:
                    config.write(text)
                self.assertEqual(load('odometry.launch', config=path).params, expected, text)
            with open(path, 'w') as config:
                config.write('- no blocks')
            with self.assertRaisesRegex(roslaunch.core.RLException, 'my config.yaml'):
                load('stereo_vo.launch', config=path)

    def test_a_configuration_that_cannot_be_read_is_named_and_leaves_no_copy(self):
        def copies():
            return set(glob.glob('/tmp/stereo_vo_config_*.yaml'))
        before = copies()
        with tempfile.TemporaryDirectory() as folder:
            pipe, large, torn = (os.path.join(folder, name) for name in ('pipe.yaml', 'large.yaml', 'torn.yaml'))
            os.mkfifo(pipe)
            with open(large, 'w') as config:
                config.truncate(2000000)
            with open(torn, 'w') as config:
                config.write('stereo_features: {detector: {max_feat')
            for path in (pipe, large, torn):
                with self.assertRaisesRegex(roslaunch.core.RLException, os.path.basename(path)):
                    load('odometry.launch', config=path)
            with open(torn, 'w') as config:
                config.write('stereo_features: {detector: {max_features: 400}}')
            load('odometry.launch', config=torn)
        self.assertEqual(copies() - before, set())

    def test_arguments_that_a_file_lacks_are_refused(self):
        """By a command line, which `roslaunch` itself does not check."""
        self.assertIn('no argument mask: in the file of config:= it is stereo_features: {detector: {mask: VALUE}}', refusal('mask:=/arm.png'))
        self.assertIn('stereo_vo.launch has no argument mount_rpy', refusal('mount_rpy:=0 0 0.5 0 0 0'))
        self.assertIn('no argument base_frame: is it base_frame_id?', refusal('base_frame:=base_footprint'))
        self.assertNotIn('no argument', refusal('base_frame_id:=base_footprint', '__log:=/tmp/x'))

    def test_rviz_shows_what_is_in_its_namespace(self):
        folder = os.path.join(FOLDER, '..', 'rviz')
        for file in os.listdir(folder):
            with open(os.path.join(folder, file)) as config:
                displays = yaml.safe_load(config)['Visualization Manager']['Displays']
            topics = [display[key] for display in displays for key in ('Topic', 'Image Topic', 'Marker Topic') if key in display]
            self.assertTrue({'path', 'odom', 'features_image'} <= set(topics), (file, topics))
            self.assertEqual([topic for topic in topics if topic.startswith('/') and not topic.startswith('/ground_truth/')], [], file)

    def test_nothing_is_set_that_nobody_reads(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, 'my first.bag')
            with rosbag.Bag(path, 'w') as bag:
                bag.write('/stereo/left/camera_info', CameraInfo(), rospy.Time(1))
            for file, expected in (('kitti.launch', ['/use_sim_time']),
                                   ('example_robot.launch', ['/robot_description', '/use_sim_time'])):
                config = load(file, bag=path, rviz='false')
                self.assertEqual([name for name in sorted(config.params) if '/stereo/' not in name], expected)
                player = next(node for node in config.nodes if node.type == 'play')
                self.assertEqual(shlex.split(player.args)[0], path)

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

    def test_another_robot_is_named_from_the_root_on(self):
        for other in ('r2', '/r2', '/r2/'):
            node = nodes(load('place_recognition.launch', other=other))['/stereo/place_recognition']
            self.assertIn('/r2/place_signature', [to for _, to in node.remap_args])

    def test_loop_closing_passes_its_arguments_on(self):
        found = parameters(loop_closing='true', map_frame_id='site', places_file='/site.bag')
        self.assertEqual(found, {'place_recognition/map_frame_id': 'site', 'place_recognition/places_file': '/site.bag'})

    def test_parameters_of_an_earlier_run_are_forgotten(self):
        stale, other = '/stereo/visual_odometry/publish_tf', '/stereo/camera/exposure'
        rospy.set_param(stale, False)
        rospy.set_param(other, 5)
        # Without a manager the nodelets wait: nothing is started.
        self.addCleanup(rospy.delete_param, '/stereo')
        roslaunch_of(self, 'stereo_vo.launch', 'start_manager:=false', 'base_frame_id:=robot')
        self.assertTrue(wait_until(lambda: rospy.get_param('/stereo/visual_odometry/base_frame_id', '') == 'robot'))
        self.assertFalse(rospy.has_param(stale))
        self.assertEqual(rospy.get_param(other), 5)

    def session(self):
        """(session, epoch) of the odometry that answers a message of ours; None where none does."""
        answers = []
        listener = rospy.Subscriber('/stereo/vo_info', VoInfo, lambda info: answers.append((info.session, info.epoch)))
        publisher = rospy.Publisher('/stereo/stereo_features', StereoFeatures, queue_size=1)
        message = StereoFeatures(image_width=640, image_height=480, fx=400.0, fy=400.0, cx=320.0, cy=240.0, baseline=0.1,
                                 descriptor='freak', layout='left+right', element_type='bits', bytes_per_row=128)

        def is_answered():
            message.header.stamp = rospy.Time.now()
            publisher.publish(message)
            return wait_until(lambda: answers, 0.3)
        wait_until(is_answered)
        listener.unregister()
        publisher.unregister()
        return answers[-1] if answers else None

    def test_killed_loaders_and_managers_are_replaced_and_told_apart(self):
        errors, service = [], '/stereo/visual_odometry/reset'
        listener = rospy.Subscriber('/rosout', Log, lambda log: errors.append(log.msg) if log.level >= Log.ERROR else None)
        self.addCleanup(listener.unregister)
        roslaunch_of(self, 'stereo_vo.launch', 'respawn:=true')

        def is_offered():
            try:
                return rosservice.get_service_node(service) is not None
            except (rosservice.ROSServiceException, rosgraph.network.ROSHandshakeException):
                return False  # it ends while it is asked
        self.assertTrue(wait_until(is_offered, 60))
        sessions = [self.session()]
        for node in ('/stereo/visual_odometry', '/stereo/stereo_vo_manager'):
            time.sleep(3)  # nodelet's loader does not notice a manager that dies before their bond is formed
            errors.clear()  # that our messages have no transform
            os.kill(node_pid(node), signal.SIGKILL)
            self.assertTrue(wait_until(lambda: not is_offered(), 60))
            self.assertTrue(wait_until(is_offered, 60))
            self.assertEqual(errors, [], node)
            sessions.append(self.session())
        # The epoch begins at zero with each, so only the session tells them apart.
        self.assertEqual([epoch for _, epoch in sessions], [0, 0, 0])
        self.assertEqual(len({session for session, _ in sessions}), 3)

    def start_manager_of_others(self):
        manager = nodelet_process('manager', '__name:=driver', '__ns:=/stereo')
        self.addCleanup(manager.kill)
        rospy.wait_for_service('/stereo/driver/list', 60)
        return manager

    def test_nodelets_in_a_manager_of_others_end_with_their_loaders_or_are_replaced(self):
        self.start_manager_of_others()
        names = rospy.ServiceProxy('/stereo/driver/list', NodeletList)

        def launch(*arguments):
            return roslaunch_of(self, *arguments, 'manager:=driver', 'start_manager:=false', stderr=subprocess.PIPE, start_new_session=True)

        def kill(process):
            """With all its loaders, which say nothing any more."""
            loaders = subprocess.run(['pgrep', '-P', str(process.pid)], stdout=subprocess.PIPE, universal_newlines=True)
            os.kill(process.pid, signal.SIGKILL)
            for pid in loaders.stdout.split():  # which lead a group of processes
                os.killpg(int(pid), signal.SIGKILL)
            process.wait()
        mine = ['/stereo/features_image', '/stereo/stereo_features', '/stereo/visual_odometry']
        first = launch('stereo_vo.launch')
        self.assertTrue(wait_until(lambda: sorted(names().nodelets) == mine, 60), names().nodelets)
        kill(first)
        self.assertTrue(wait_until(lambda: names().nodelets == [], 60), names().nodelets)
        second = launch('odometry.launch', 'bond:=false')
        self.assertTrue(wait_until(lambda: names().nodelets == mine[-1:], 60), names().nodelets)
        session = self.session()
        kill(second)
        third = launch('odometry.launch', 'bond:=false')
        self.assertTrue(wait_until(lambda: self.session() not in (None, session), 60))
        self.assertEqual(names().nodelets, mine[-1:])
        third.terminate()
        self.assertIn('/stereo/visual_odometry of an earlier launch is still in /stereo/driver: it is replaced',
                      third.communicate()[1])

    def test_the_end_and_the_halt_of_anothers_manager_are_explained(self):
        def expect(words, disturb):
            manager = self.start_manager_of_others()
            said = tempfile.NamedTemporaryFile()
            process = roslaunch_of(self, 'odometry.launch', 'manager:=driver', 'start_manager:=false', stderr=said, start_new_session=True)
            disturb(manager)
            # A bond takes 10 s to break.
            self.assertTrue(wait_until(lambda: words in pathlib.Path(said.name).read_text(), 60), words)
            process.terminate()
            manager.send_signal(signal.SIGCONT)
            manager.terminate()
            manager.wait()
            process.wait()

        def kill(manager):
            self.assertIsNotNone(self.session())
            time.sleep(3)  # until the bond is formed
            manager.kill()
        expect('has ended with its manager driver, or its loader was killed: respawn:=true loads it again', kill)
        expect('the nodelet manager does not answer', lambda manager: manager.send_signal(signal.SIGSTOP))

    def test_a_recording_takes_over_from_a_pipeline_of_the_same_namespace(self):
        self.addCleanup(lambda: rospy.has_param('/use_sim_time') and rospy.delete_param('/use_sim_time'))
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, 'a recording.bag')
            with rosbag.Bag(path, 'w') as bag:
                for i in range(3):
                    for side in ('left', 'right'):
                        for name, message in (('camera_info', CameraInfo()), ('image_rect', Image())):
                            message.header.stamp = rospy.Time(10 + i)
                            bag.write('/stereo/%s/%s' % (side, name), message, message.header.stamp)
            roslaunch_of(self, 'stereo_vo.launch')
            rospy.wait_for_service('/stereo/visual_odometry/reset', 60)
            # Ends with the bag, which waits for subscribers to the images.
            play = ['timeout', '-s', 'INT', '60', 'roslaunch', PACKAGE, 'kitti.launch', 'rviz:=false', 'camera_tf:=false']
            self.assertEqual(subprocess.run(play + ['bag:=' + path]).returncode, 0)

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
