#!/usr/bin/env python3
"""Two camera_info YAMLs, as camera_info_manager and two_cameras.launch read them, from a camera chain of Kalibr.

    rosrun stereo_descriptor_vo kalibr_to_camera_info.py camchain.yaml --output FOLDER [--left cam0 --right cam1]

writes FOLDER/left.yaml and FOLDER/right.yaml: D and K are Kalibr's; R and P rectify the pair (OpenCV, equal rows, no black borders). A wide
lens is rectified to 110 degrees from side to side, which keeps the resolution of its middle, or to those of --fov."""

import argparse
import math
import os
import sys

import numpy as np
import yaml

try:
    import cv2
except ImportError:
    sys.exit('error: rectifying needs OpenCV for Python (python3-opencv)')

WIDEST = 110.0  # deg; at the edge a pixel sees a third (cos^2) of the angle that one in the middle sees


class Camera:
    """K, D and size of one camera of the chain, and what ROS calls its lens."""

    def __init__(self, chain, name):
        if name not in chain:
            raise ValueError('there is no %s, only %s' % (name, ', '.join(chain)))
        block = chain[name]
        if block.get('camera_model', 'pinhole') != 'pinhole':
            raise ValueError('%s is %s: camera_info has only pinhole cameras; calibrate with pinhole-radtan or pinhole-equi'
                             % (name, block['camera_model']))
        lens = block.get('distortion_model', 'none')
        d = [float(x) for x in block.get('distortion_coeffs') or []]
        if lens == 'radtan':
            self.lens, self.d = 'plumb_bob', d + [0.0]
        elif lens == 'equidistant':
            self.lens, self.d = 'equidistant', d
        elif lens == 'none':
            self.lens, self.d = 'plumb_bob', [0.0] * 5
        else:
            raise ValueError('%s has distortion_model %s: camera_info has radtan and equidistant; calibrate with one of these'
                             % (name, lens))
        if lens != 'none' and len(d) != 4:
            raise ValueError('%s has %d distortion_coeffs, 4 are expected' % (name, len(d)))
        fx, fy, cx, cy = (float(x) for x in block['intrinsics'])
        self.k = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        self.size = tuple(int(x) for x in block['resolution'])


def transform(chain, left, right):
    """T_right_left. Each camera has T_cn_cnm1: points of the camera before it, in its own frame."""
    names = sorted((name for name in chain if name.startswith('cam')), key=lambda name: int(name[3:]))
    from_first, T = {}, np.eye(4)
    for i, name in enumerate(names):
        if i > 0:
            T = np.array(chain[name]['T_cn_cnm1'], float) @ T
        from_first[name] = T
    return from_first[right] @ np.linalg.inv(from_first[left])


def focal_length(width, fov):
    return width / 2 / math.tan(math.radians(fov) / 2)


def rectify(left, right, T, fov):
    """R and P of both. fov in deg; 0: what has no black borders, at most WIDEST."""
    if left.size != right.size or left.lens != right.lens:
        raise ValueError('both cameras need the same resolution and the same distortion_model')
    R, t = T[:3, :3], T[:3, 3]
    if abs(t[1]) > abs(t[0]):
        raise ValueError('one camera is above the other; only rigs side by side are supported. Turn the images by 90 degrees before '
                         'you calibrate, so that the upper camera becomes the left or the right one')
    if t[0] > 0:
        raise ValueError('the right camera is to the left of the left one: exchange --left and --right')
    if left.lens == 'equidistant':
        found = cv2.fisheye.stereoRectify(left.k, np.array(left.d), right.k, np.array(right.d), left.size, R, t,
                                          cv2.fisheye.CALIB_ZERO_DISPARITY, balance=0.0)
    else:
        found = cv2.stereoRectify(left.k, np.array(left.d), right.k, np.array(right.d), left.size, R, t,
                                  flags=cv2.CALIB_ZERO_DISPARITY, alpha=0)
    R1, R2, P1, P2 = found[:4]
    width, height = left.size
    if fov == 0 and not P1[0, 0] >= focal_length(width, WIDEST):
        fov = WIDEST
    if fov > 0:
        f, baseline = focal_length(width, fov), -P2[0, 3] / P2[0, 0]
        for P in P1, P2:
            P[:, :3] = [[f, 0, (width - 1) / 2], [0, f, (height - 1) / 2], [0, 0, 1]]
        P2[0, 3] = -f * baseline
    return (R1, P1), (R2, P2)


def matrix(values):
    values = np.atleast_2d(values)
    return {'rows': values.shape[0], 'cols': values.shape[1], 'data': [float(x) for x in values.ravel()]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('camchain', help="Kalibr's camchain YAML")
    parser.add_argument('--output', required=True, metavar='FOLDER', help='made if it is not there')
    parser.add_argument('--left', default='cam0', help='name in the chain (%(default)s)')
    parser.add_argument('--right', default='cam1', help='name in the chain (%(default)s)')
    parser.add_argument('--fov', type=float, default=0, help='field of view of the rectified images, from side to side, deg')
    arguments = parser.parse_args()
    if not 0 <= arguments.fov <= 170:
        parser.error('--fov is between 0 and 170 deg')
    try:
        with open(arguments.camchain) as file:
            chain = yaml.safe_load(file)
        if not isinstance(chain, dict):
            raise ValueError('it is no camera chain')
        left, right = Camera(chain, arguments.left), Camera(chain, arguments.right)
        sides = rectify(left, right, transform(chain, arguments.left, arguments.right), arguments.fov)
        os.makedirs(arguments.output, exist_ok=True)
        for name, camera, (R, P) in zip(('left', 'right'), (left, right), sides):
            with open(os.path.join(arguments.output, name + '.yaml'), 'w') as file:
                yaml.safe_dump({'image_width': camera.size[0], 'image_height': camera.size[1], 'camera_name': name,
                                'camera_matrix': matrix(camera.k), 'distortion_model': camera.lens,
                                'distortion_coefficients': matrix(camera.d), 'rectification_matrix': matrix(R),
                                'projection_matrix': matrix(P)}, file, sort_keys=False, default_flow_style=None)
    except (OSError, ValueError, TypeError, KeyError, yaml.YAMLError) as error:
        sys.exit('%s: %s%s' % (arguments.camchain, 'no ' if isinstance(error, KeyError) else '', error))
    fx, cx, cy, tx = sides[1][1][0, 0], sides[1][1][0, 2], sides[1][1][1, 2], sides[1][1][0, 3]
    print('baseline %.4f m, rectified focal length %.1f px, centre %.1f, %.1f px' % (-tx / fx, fx, cx, cy))


if __name__ == '__main__':
    main()
