#!/usr/bin/env python3
"""Launch prefix of `record -O FILE TOPIC …`, after the image side's name: waits until that has images, and adds what it reads. A file
that is there stays: the drive gets the next number."""

import itertools
import os
import shutil
import sys
import time

import rosgraph
from rosgraph.names import get_ros_namespace, load_mappings, resolve_name

LEAST = 2**30  # bytes; rosbag records nothing where less is free


def unused(path):
    """A file, and whether it has the name asked for."""
    root = os.path.abspath(os.path.expanduser(path))
    root = root[:-len('.bag')] if root.endswith('.bag') else root
    names = (root + number + '.bag' for number in itertools.chain([''], ('_%d' % i for i in itertools.count(2))))
    file = next(name for name in names if not os.path.lexists(name) and not os.path.lexists(name + '.active'))
    return file, file == root + '.bag'


def refuse(why):
    sys.exit('[ERROR] nothing is recorded: ' + why)


def inputs(image_side):
    """Images and calibrations, with their transport's ending, once somebody publishes the images."""
    master = rosgraph.Master('/record_drive')
    image_side = resolve_name(image_side, get_ros_namespace() + 'recorder')
    while True:
        if master.hasParam(image_side + '/input_topics'):
            topics = master.getParam(image_side + '/input_topics')
            if {name for name, _ in master.getPublishedTopics('')}.issuperset(topics[:2]):
                return topics
        time.sleep(0.2)


def resolved(arguments):
    """Topics by their full names, which the bag keeps; the recorder would write those that it is given."""
    node = get_ros_namespace() + 'recorder'
    remaps = {resolve_name(a, node): resolve_name(b, node) for a, b in load_mappings(arguments).items()}
    return [argument if ':=' in argument else resolve_name(argument, node, remaps) for argument in arguments]


def main(image_side, recorder, option, path, *topics):
    file, is_asked_for = unused(path)
    folder = os.path.dirname(file)
    if not os.access(folder, os.W_OK):
        refuse('there is no folder %s that may be written' % folder)
    if shutil.disk_usage(folder).free < LEAST:
        refuse('less than 1 GB is free in %s' % folder)
    how = '[ INFO]' if is_asked_for else '[ WARN] an older drive has the name asked for:'
    print('%s recording to %s once there are images' % (how, file), file=sys.stderr, flush=True)
    os.execv(recorder, [recorder, option, file, *resolved(topics), *inputs(image_side)])


if __name__ == '__main__':
    try:
        main(*sys.argv[1:])
    except KeyboardInterrupt:
        refuse('there were no images')
