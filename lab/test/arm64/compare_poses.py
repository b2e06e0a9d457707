#!/usr/bin/env python3
"""How far two files of poses in KITTI's format differ at most. Exit code 1 where that is above 1e-6 m or 1e-6 rad."""
import argparse
import sys

import numpy


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('one')
    parser.add_argument('other')
    parser.add_argument('--translation', type=float, default=1e-6, help='m')
    parser.add_argument('--rotation', type=float, default=1e-6, help='rad')
    arguments = parser.parse_args()
    one, other = (numpy.loadtxt(name, ndmin=2).reshape(-1, 3, 4) for name in (arguments.one, arguments.other))
    if len(one) != len(other) or len(one) == 0:
        print(f'{arguments.one} has {len(one)} poses, {arguments.other} {len(other)}')
        return 1
    translation = numpy.linalg.norm(one[:, :, 3] - other[:, :, 3], axis=1).max()
    # Small angles: the skew part of the relative rotation is the rotation vector's.
    relative = numpy.einsum('nji,njk->nik', one[:, :, :3], other[:, :, :3])
    skew = 0.5 * (relative - relative.transpose(0, 2, 1))
    rotation = numpy.linalg.norm(skew[:, [2, 0, 1], [1, 2, 0]], axis=1).max()
    print(f'{arguments.one}: {len(one)} poses differ by at most {translation:.2g} m and {rotation:.2g} rad')
    return 0 if translation <= arguments.translation and rotation <= arguments.rotation else 1


if __name__ == '__main__':
    sys.exit(main())
