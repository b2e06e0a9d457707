#!/usr/bin/env python3
"""Copies a YAML file for config.launch: blocks and values that are left empty are left out."""

import sys

import rosparam  # noqa: F401 reads !degrees and !radians for yaml
import yaml


def without_empty(value):
    return {k: without_empty(v) for k, v in value.items() if v is not None} if isinstance(value, dict) else value


def main(path, copy):
    try:
        with open(path) as file:
            config = yaml.safe_load(file) or {}
        if not isinstance(config, dict):
            raise ValueError('it has no blocks such as "stereo_features:"')
        with open(copy, 'x') as file:
            yaml.safe_dump(without_empty(config), file)
    except (OSError, ValueError, yaml.YAMLError) as error:
        sys.exit('ERROR: config %s: %s' % (path, error))


if __name__ == '__main__':
    main(*sys.argv[1:])
