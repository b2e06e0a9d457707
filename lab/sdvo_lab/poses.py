"""Poses as stacks of 4x4 matrices, in files of KITTI's format."""
import sys

import cv2
import numpy


def read(path, count=None):
    """The first `count` poses of a file (default: all)."""
    rows = numpy.loadtxt(path, ndmin=2)
    if rows.shape[1] != 12 or (count and len(rows) < count):
        sys.exit(f"error: {path} has {len(rows)} poses of {rows.shape[1]} numbers; needed: {count or 'some'} of 12")
    poses = numpy.tile(numpy.eye(4), (len(rows[:count]), 1, 1))
    poses[:, :3] = rows[:count].reshape(-1, 3, 4)
    return poses


def write(path, poses):
    numpy.savetxt(path, [pose[:3].ravel() for pose in poses], "%.12e")


def translation(xyz):
    T = numpy.eye(4)
    T[:3, 3] = xyz
    return T


def relative(a, b):
    """Pose b seen from pose a."""
    return numpy.linalg.inv(a) @ b


def logarithm(T):
    """(m, rad) of a small motion."""
    return numpy.concatenate([T[:3, 3], cv2.Rodrigues(T[:3, :3])[0].ravel()])


def square(error, covariance):
    """An error's square in standard deviations."""
    return float(error @ numpy.linalg.solve(covariance, error))


def sigmas(error, covariance):
    """A motion's error in translation and in rotation, in standard deviations."""
    return [square(error[part], covariance[part, part]) ** 0.5 for part in (slice(0, 3), slice(3, 6))]
