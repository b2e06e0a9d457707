#!/usr/bin/env python3
"""Copies a YAML file for config.launch: blocks and values that are left empty are left out."""

import os
import sys
import time

import rosparam  # noqa: F401 reads !degrees and !radians for yaml
import yaml

LARGEST = 1000000  # bytes, of options
LONGEST = 60  # s that a launch takes to read the copy


def without_empty(value):
    return {k: without_empty(v) for k, v in value.items() if v is not None} if isinstance(value, dict) else value


def remove_with_the_launch(copy):
    """In a process of its own: a launch that fails has no last word."""
    launch = os.getppid()
    if os.fork() > 0:
        return
    os.setsid()
    for stream in (0, 1, 2):  # which the launch reads to their end
        os.dup2(os.open(os.devnull, os.O_RDWR), stream)
    end = time.monotonic() + LONGEST
    while os.path.exists(copy) and os.path.exists('/proc/%d' % launch) and time.monotonic() < end:
        time.sleep(0.1)
    if os.path.exists(copy):
        os.remove(copy)
    os._exit(0)


def main(path, copy):
    try:
        if not os.path.isfile(path):
            raise ValueError('there is no such file')  # a pipe would be waited for
        if os.path.getsize(path) > LARGEST:
            raise ValueError('it is too large for options')
        with open(path) as file:
            config = yaml.safe_load(file) or {}
        if not isinstance(config, dict):
            raise ValueError('it has no blocks such as "stereo_features:"')
        with open(copy, 'x') as file:
            yaml.safe_dump(without_empty(config), file)
    except (OSError, ValueError, yaml.YAMLError) as error:
        sys.exit('ERROR: config %s: %s' % (path, error))
    remove_with_the_launch(copy)


if __name__ == '__main__':
    main(*sys.argv[1:])
