#!/usr/bin/env python3
"""Copies a YAML file for config.launch: blocks and values that are left empty are left out, and what has no effect is named, in the
file and among the arguments of roslaunch."""

import difflib
import glob
import os
import sys
import xml.etree.ElementTree

import rosparam  # noqa: F401 reads !degrees and !radians for yaml
import yaml

BLOCKS = ('stereo_features', 'visual_odometry', 'place_recognition', 'features_image')
# Options that users look for among the arguments.
OPTIONS = ('stereo_features/detector/mask', 'stereo_features/detector/max_features', 'stereo_features/find_camera', 'stereo_features/max_rate', 'stereo_features/sync_tolerance',
           'visual_odometry/initial_pose', 'visual_odometry/publish_null_when_lost',
           'place_recognition/robot_name', 'place_recognition/save_at_shutdown')
LARGEST = 1000000  # bytes, of options


def without_empty(value):
    if not isinstance(value, dict):
        return value
    inner = {key: without_empty(v) for key, v in value.items()}
    return {key: v for key, v in inner.items() if v is not None and v != {}}


def warn(path, problem):
    print('[ WARN] config %s: %s' % (path, problem), file=sys.stderr, flush=True)


def name_duplicates(path, node):
    """yaml takes the last one."""
    if not isinstance(node, yaml.CollectionNode):
        return
    keys = set()
    for child in node.value:
        if isinstance(child, tuple):
            if child[0].value in keys:
                warn(path, 'line %d: %s is there twice, the last one holds' % (child[0].start_mark.line + 1, child[0].value))
            keys.add(str(child[0].value))
        name_duplicates(path, child[1] if isinstance(child, tuple) else child)


def check(value, name):
    """That the parameter server has room for it."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if not isinstance(key, str):
                raise ValueError('%s%s is no name: quote it' % (name, key))
            check(inner, name + key + '/')
    elif isinstance(value, list):
        for inner in value:
            check(inner, name)
    elif not isinstance(value, (str, int, float)):
        raise ValueError('%s = %s is a %s: quote it' % (name[:-1], value, type(value).__name__))
    elif isinstance(value, int) and abs(value) >= 2**31:
        raise ValueError('%s = %s does not fit into 32 bits' % (name[:-1], value))


def as_yaml(path):
    *blocks, option = path.split('/')
    return ''.join(block + ': {' for block in blocks) + option + ': VALUE' + '}' * len(blocks)


def refuse_unknown_arguments():
    """Of `roslaunch stereo_descriptor_vo FILE name:=value`, from which `roslaunch` leaves out names that the file lacks."""
    with open('/proc/%d/cmdline' % os.getppid()) as file:
        words = file.read().split('\0')
    if 'stereo_descriptor_vo' not in words[:-1]:
        return
    file = words[words.index('stereo_descriptor_vo') + 1]
    for path in glob.glob(os.path.join(glob.escape(os.path.dirname(os.path.abspath(__file__))), '**', file), recursive=True):
        arguments = xml.etree.ElementTree.parse(path).getroot().findall('arg')
        known = [argument.get('name') for argument in arguments if argument.get('value') is None]
        for name in (word.split(':=')[0] for word in words if ':=' in word and not word.startswith('__')):
            if name not in known:
                option = [path for path in OPTIONS if path.endswith('/' + name)]
                if option:
                    sys.exit('ERROR: %s has no argument %s: in the file of config:= it is %s' % (file, name, as_yaml(option[0])))
                alike = difflib.get_close_matches(name, known, 1)
                sys.exit('ERROR: %s has no argument %s%s; roslaunch --ros-args stereo_descriptor_vo %s lists them' % (
                    file, name, ': is it %s?' % alike[0] if alike else '', file))


def main(path, copy):
    refuse_unknown_arguments()
    try:
        if not os.path.isfile(path):
            raise ValueError('there is no such file')  # a pipe would be waited for
        if os.path.getsize(path) > LARGEST:
            raise ValueError('it is too large for options')
        with open(path) as file:
            text = file.read()
        whole = yaml.safe_load(text) or {}
        if not isinstance(whole, dict):
            raise ValueError('it has no blocks such as "stereo_features:"')
        config = without_empty(whole)
        check(config, '')
        name_duplicates(path, yaml.compose(text, yaml.SafeLoader))
        for block in whole:
            if block not in BLOCKS:
                warn(path, '%s is of no nodelet here and has no effect on them: their blocks are %s' % (block, ', '.join(BLOCKS)))
        with open(copy, 'x') as file:
            yaml.safe_dump(config, file)
    except (OSError, ValueError, yaml.YAMLError) as error:
        sys.exit('ERROR: config %s: %s' % (path, error))


if __name__ == '__main__':
    main(*sys.argv[1:])
