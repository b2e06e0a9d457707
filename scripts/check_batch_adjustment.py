#!/usr/bin/env python3
"""What a sequence's images and calibration allow: adjusts all its pairs at once, which no odometry can, from tracks of its
own, and compares the odometry with that. Corners of every sixth left image are tracked through all others (Lucas-Kanade, each
time against the patch they were found with, so that errors do not add up) and into the right images; poses and points
minimise the distances to them. Two more adjustments have half of the points each: how far these are apart is what noise
does, and what an adjustment is farther away from the truth is the calibration's or the truth's own. Patches do not follow
scale: for a camera that hovers or turns. Needs python3-scipy; takes some minutes."""
import argparse
import collections
import pathlib

import cv2
import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from check_ground_truth import kitti_errors, read_poses, rotation_vector

EVERY = 6  # pairs from one image whose corners are tracked to the next one
WINDOW = dict(winSize=(15, 15), maxLevel=0, criteria=(3, 30, 0.003), flags=cv2.OPTFLOW_USE_INITIAL_FLOW)
WIDE = dict(winSize=(21, 21), maxLevel=4)
MARGIN = 12  # px

Camera = collections.namedtuple('Camera', 'f cx cy baseline')
Sightings = collections.namedtuple('Sightings', 'pair point measured')  # measured: u, v, u in the right image (nan: none), px


def read_camera(path):
    rows = dict(line.split(':') for line in open(path) if line.strip())
    left, right = (np.array(rows[name].split(), float) for name in ('P0', 'P1'))
    return Camera(left[0], left[2], left[6], -right[3] / right[0])


def follow(reference, corners, before, after, positions):
    """Where patches of `reference` at `corners` lie in the image `after`, from their positions in the one before; bool: found."""
    guess, seen, _ = cv2.calcOpticalFlowPyrLK(before, after, positions, None, **WIDE)
    found, aligned, difference = cv2.calcOpticalFlowPyrLK(reference, after, corners, guess.copy(), **WINDOW)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, reference, found, corners.copy(), **WINDOW)
    height, width = after.shape
    good = (seen & aligned & returned).ravel() > 0
    good &= np.linalg.norm(found - guess, axis=2).ravel() < 2
    good &= np.linalg.norm(back - corners, axis=2).ravel() < 0.15
    good &= (difference.ravel() < 12) & np.all((found > MARGIN) & (found < (width - MARGIN, height - MARGIN)), axis=2).ravel()
    return found, good


def columns_in_right(left, right, positions):
    """u in the right image, nan where none was found."""
    guess, seen, _ = cv2.calcOpticalFlowPyrLK(left, right, positions, None, **WIDE)
    found, aligned, _ = cv2.calcOpticalFlowPyrLK(left, right, positions, guess, **WINDOW)
    disparity, dv = (positions - found)[:, 0].T
    good = ((seen & aligned).ravel() > 0) & (abs(dv) < 1) & (disparity > 1)
    return np.where(good, found[:, 0, 0], np.nan)


def track(left, right):
    """Sightings of corners that at least five pairs see and three of them with a disparity."""
    pairs, points, measured, count = [], [], [], 0
    for first in range(0, len(left), EVERY):
        corners = cv2.goodFeaturesToTrack(left[first], 250, 0.005, 14)
        for step in (1, -1):
            positions, alive, last = corners, np.ones(len(corners), bool), first
            for k in range(first, len(left)) if step > 0 else range(first - 1, -1, -1):
                if k != first:
                    positions, good = follow(left[first], corners, left[last], left[k], positions)
                    alive &= good
                seen = np.flatnonzero(alive)
                pairs.append(np.full(len(seen), k))
                points.append(count + seen)
                measured.append(np.c_[positions[seen, 0], columns_in_right(left[k], right[k], positions)[seen]])
                last = k
        count += len(corners)
    all_ = Sightings(np.concatenate(pairs), np.concatenate(points), np.concatenate(measured).astype(float))
    with_disparity = np.bincount(all_.point, ~np.isnan(all_.measured[:, 2]), count)
    enough = (np.bincount(all_.point, minlength=count) >= 5) & (with_disparity >= 3)
    return take(all_, enough)


def take(sightings, chosen):
    """Those of the chosen points (bool), which are numbered anew."""
    kept = chosen[sightings.point]
    numbers = np.cumsum(chosen) - 1
    return Sightings(sightings.pair[kept], numbers[sightings.point[kept]], sightings.measured[kept])


def triangulate(sightings, camera, poses):
    """Points in the world, each from its first sighting with a disparity."""
    seen = np.flatnonzero(~np.isnan(sightings.measured[:, 2]))
    _, first = np.unique(sightings.point[seen], return_index=True)
    u, v, right = sightings.measured[seen[first]].T
    z = camera.f * camera.baseline / (u - right)
    rays = np.c_[(u - camera.cx) / camera.f, (v - camera.cy) / camera.f, np.ones(len(z))] * z[:, None]
    at = poses[sightings.pair[seen[first]]]
    return np.einsum('nij,nj->ni', at[:, :3, :3], rays) + at[:, :3, 3]


def residuals(sightings, camera, poses, points):
    """N x 3, px; 0 where there is no disparity."""
    at = poses[sightings.pair]
    x, y, z = np.einsum('nji,nj->in', at[:, :3, :3], points[sightings.point] - at[:, :3, 3])
    predicted = np.c_[camera.f * x / z + camera.cx, camera.f * y / z + camera.cy, camera.f * (x - camera.baseline) / z + camera.cx]
    return np.nan_to_num(predicted - sightings.measured)


def moved(poses, steps):
    """Poses turned and shifted by steps (N x 6: rotation vector in the camera, translation in the world)."""
    result = poses.copy()
    for pose, step in zip(result, steps):
        pose[:3, :3] = pose[:3, :3] @ cv2.Rodrigues(step[:3])[0]
        pose[:3, 3] += step[3:]
    return result


def adjust(sightings, camera, poses, steps=25):
    """Poses that explain the sightings best, the first one held, and the standard deviations of u, v and u in the right image;
    Gauss-Newton with numerical derivatives, Huber weights and standard deviations from the residuals themselves."""
    points, n = triangulate(sightings, camera, poses), len(poses)
    present = ~np.isnan(sightings.measured)
    h, unit = 1e-6, np.eye(6)
    for step in range(steps):
        error = residuals(sightings, camera, poses, points)
        sigma = np.array([1.4826 * np.median(abs(error[present[:, i], i])) for i in range(3)]) if step > 2 else np.full(3, 0.5)
        ratio = abs(error) / sigma
        weight = present * (ratio < 8) / np.maximum(1, ratio / 1.5) / sigma ** 2

        columns, values = [], []
        for i in range(6):
            values.append(residuals(sightings, camera, moved(poses, np.tile(h * unit[i], (n, 1))), points) - error)
            columns.append(6 * sightings.pair + i)
        for i in range(3):
            values.append(residuals(sightings, camera, poses, points + h * unit[i, :3]) - error)
            columns.append(6 * n + 3 * sightings.point + i)
        rows = np.tile(np.arange(error.size), len(values))
        jacobian = scipy.sparse.csr_matrix((np.concatenate([v.ravel() for v in values]) / h,
                                            (rows, np.concatenate([np.repeat(c, 3) for c in columns]))))
        normal = jacobian.T @ scipy.sparse.diags(weight.ravel()) @ jacobian
        damping = 1e-6 + (1e-4 if step < 5 else 1e-8) * normal.diagonal()
        damping[:6] = 1e12
        change = -scipy.sparse.linalg.spsolve((normal + scipy.sparse.diags(damping)).tocsc(), jacobian.T @ (weight * error).ravel())
        poses = moved(poses, change[:6 * n].reshape(-1, 6))
        points = points + change[6 * n:].reshape(-1, 3)
        if abs(change[:6 * n]).max() < 1e-7:
            break
    return poses, sigma


def difference(a, b, pairs):
    """rms of the angles (deg) between the motions over so many pairs."""
    def turns(poses):
        return [np.linalg.inv(x) @ y for x, y in zip(poses, poses[pairs:])]
    return np.sqrt(np.mean([np.sum(rotation_vector(np.linalg.inv(x) @ y) ** 2) for x, y in zip(turns(a), turns(b))]))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('sequence', type=pathlib.Path, help='folder in KITTI layout')
    parser.add_argument('--ground-truth', type=pathlib.Path, required=True, help='poses; the adjustments begin there')
    parser.add_argument('--estimate', type=pathlib.Path, required=True, help="run_sequence's poses")
    parser.add_argument('--lengths', default='0.1,0.2,0.3,0.4,0.5', help='of sub-paths, m')
    arguments = parser.parse_args()

    estimate = read_poses(arguments.estimate)
    truth = read_poses(arguments.ground_truth, len(estimate))
    left, right = ([cv2.imread(str(arguments.sequence / side / ('%06d.png' % i)), 0) for i in range(len(truth))]
                   for side in ('image_0', 'image_1'))
    camera = read_camera(arguments.sequence / 'calib.txt')
    sightings = track(left, right)
    count = sightings.point.max() + 1
    chosen = np.random.default_rng(1).permutation(count) < count // 2
    batch, sigma = adjust(sightings, camera, truth)
    halves = [adjust(take(sightings, half), camera, truth)[0] for half in (chosen, ~chosen)]

    print('%d sightings of %d points, residuals of %.3f, %.3f and %.3f px' % (len(sightings.pair), count, *sigma))
    print('errors against the truth, t in %, r in deg/m')
    lengths = [float(x) for x in arguments.lengths.split(',')]
    for name, poses in (('odometry', estimate), ('all pairs adjusted at once', batch), ('... first half of the points', halves[0]),
                        ('... second half', halves[1])):
        print('  %-30s %.2f  %.3f' % (name, *kitti_errors(truth, poses, lengths)))
    spans = [n for n in (1, 5, 10, 20, 40) if n < len(truth)]
    print('rms difference of rotations, deg, over so many pairs ' + ''.join('%8d' % n for n in spans))
    for name, a, b in (('odometry - truth', estimate, truth), ('adjusted - truth', batch, truth), ('odometry - adjusted', estimate, batch),
                       ('one half - the other', *halves)):
        print('  %-51s' % name + ''.join('%8.3f' % difference(a, b, n) for n in spans))


if __name__ == '__main__':
    main()
