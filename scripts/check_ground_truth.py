#!/usr/bin/env python3
"""Tells an odometry's errors on KITTI from the ground truth's own: compares both with a third estimate of rotation and
direction of motion that shares nothing with the odometry. It tracks corners through the left images (Lucas-Kanade) and
fits the epipolar geometry of each pair of them; no stereo, no descriptors, no map, no calibration. Where it agrees with
the odometry and both differ from the ground truth, the latter is off. Needs python3-scipy."""
import argparse
import pathlib

import cv2
import numpy as np
from scipy.optimize import least_squares

LENGTHS = (5, 10, 20, 30, 40, 50)  # m


def read_poses(path, count=None):
    rows = np.loadtxt(path).reshape(-1, 3, 4)[:count]
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3] = rows
    return poses


def motions(poses):
    return [np.linalg.inv(a) @ b for a, b in zip(poses, poses[1:])]


def chain(steps):
    poses = [np.eye(4)]
    for step in steps:
        poses.append(poses[-1] @ step)
    return poses


def rotation_vector(rotation):
    """Degrees about x, y, z."""
    return np.degrees(cv2.Rodrigues(np.ascontiguousarray(rotation[:3, :3]))[0].ravel())


def direction(step):
    return step[:3, 3] / np.linalg.norm(step[:3, 3])


def kitti_errors(truth, estimate, lengths=LENGTHS):
    """Mean translation error (%) and rotation error (deg/m) over all sub-paths."""
    way = np.r_[0, np.cumsum([np.linalg.norm(step[:3, 3]) for step in motions(truth)])]
    t, r = [], []
    for i in range(len(truth)):
        for length in lengths:
            j = np.searchsorted(way, way[i] + length)
            if j >= len(truth):
                continue
            error = np.linalg.inv(np.linalg.inv(truth[i]) @ truth[j]) @ (np.linalg.inv(estimate[i]) @ estimate[j])
            t.append(100 * np.linalg.norm(error[:3, 3]) / length)
            r.append(np.linalg.norm(rotation_vector(error)) / length)
    return np.mean(t), np.mean(r)


def track(a, b):
    """Positions of corners in both images, those that track back to where they came from."""
    corners = cv2.goodFeaturesToTrack(a, 3000, 0.002, 8, blockSize=5)
    how = dict(winSize=(21, 21), maxLevel=5, criteria=(3, 40, 0.003))
    there, found, _ = cv2.calcOpticalFlowPyrLK(a, b, corners, None, **how)
    back, found_back, _ = cv2.calcOpticalFlowPyrLK(b, a, there, None, **how)
    good = (found.ravel() > 0) & (found_back.ravel() > 0) & (np.linalg.norm((back - corners)[:, 0], axis=1) < 0.1)
    return corners[good, 0].astype(float), there[good, 0].astype(float)


def epipolar_motion(a, b, camera, start):
    """T_a_b with a translation of length 1 from the left images alone; `start` (4x4) only begins the iteration."""
    rays = [np.c_[(p - camera[:2, 2]) / camera[[0, 1], [0, 1]], np.ones(len(p))] for p in track(a, b)]

    def unpack(x):
        z = np.sqrt(max(1e-6, 1 - x[3] ** 2 - x[4] ** 2))
        return cv2.Rodrigues(x[:3])[0], np.array([x[3], x[4], z])

    def residuals(x):
        rotation, translation = unpack(x)
        essential = np.cross(np.eye(3), translation) @ rotation
        line_a, line_b = rays[1] @ essential.T, rays[0] @ essential
        norm = np.sqrt((line_a[:, :2] ** 2).sum(axis=1) + (line_b[:, :2] ** 2).sum(axis=1))
        return camera[0, 0] * (rays[0] * line_a).sum(axis=1) / norm  # px

    x = np.r_[cv2.Rodrigues(np.ascontiguousarray(start[:3, :3]))[0].ravel(), direction(start)[:2]]
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = unpack(least_squares(residuals, x, loss='cauchy', f_scale=0.15).x)
    return motion


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--kitti', type=pathlib.Path, required=True, help='folder with sequences/ and poses/')
    parser.add_argument('--sequence', required=True, help='for example 06')
    parser.add_argument('--estimate', type=pathlib.Path, required=True, help="run_sequence's poses of that sequence")
    arguments = parser.parse_args()

    folder = arguments.kitti / 'sequences' / arguments.sequence
    camera = np.array(open(folder / 'calib.txt').readline().split()[1:], float).reshape(3, 4)[:, :3]
    estimate = read_poses(arguments.estimate)
    truth = read_poses(arguments.kitti / 'poses' / (arguments.sequence + '.txt'), len(estimate))
    images = [cv2.imread(str(folder / 'image_0' / ('%06d.png' % i)), 0) for i in range(len(estimate))]
    ours, true = motions(estimate), motions(truth)
    alone = [epipolar_motion(a, b, camera, step) for a, b, step in zip(images, images[1:], ours)]

    def difference(a, b):
        turns = [rotation_vector(np.linalg.inv(x) @ y) for x, y in zip(a, b)]
        return np.sqrt(np.mean(np.square(turns), axis=0))

    print('rms difference of the rotations from pair to pair, deg about x, y, z')
    for name, a, b in (('odometry - truth', true, ours), ('left images - truth', true, alone),
                       ('odometry - left images', alone, ours)):
        print('  %-24s %.3f %.3f %.3f' % (name, *difference(a, b)))

    print('direction of motion in the camera, less that of the truth, mean, deg to the right and downwards')
    for name, steps in (('odometry', ours), ('left images', alone)):
        off = np.degrees(np.mean([direction(a) - direction(b) for a, b in zip(steps, true)], axis=0))
        print('  %-24s %+.2f %+.2f' % (name, off[0], off[1]))

    def with_parts(rotations, directions, lengths):
        steps = []
        for r, d, l in zip(rotations, directions, lengths):
            step = r.copy()
            step[:3, 3] = direction(d) * np.linalg.norm(l[:3, 3])
            steps.append(step)
        return chain(steps)

    print('errors against the truth, t in %, r in deg/m')
    for name, poses in (('odometry', estimate), ('odometry, rotations of the left images', with_parts(alone, ours, ours)),
                        ('odometry, lengths of the truth', with_parts(ours, ours, true)),
                        ('odometry, directions of the truth', with_parts(ours, true, ours))):
        print('  %-40s %.3f  %.4f' % (name, *kitti_errors(truth, poses)))


if __name__ == '__main__':
    main()
