"""Writes a stereo drive in another guise: the same images in another order, turned, cut or spoilt, with the calibration and the
truth that follow from the drive's own. An odometry should not care.

    lab/run guises DRIVE mirrored OUTPUT
    lab/run guises kitti:06 half OUTPUT --frames 30

The poses written are those of the guise's own left camera. Images that do not change are linked, not copied: a drive that has to be
rendered or rectified first stays beside OUTPUT."""
import dataclasses
import pathlib
import sys

import cv2
import numpy as np

from . import drives, poses


@dataclasses.dataclass
class View:
    """One image of a pair: where its pixels come from, and the camera that would take it."""
    path: pathlib.Path
    K: np.ndarray  # 3x3, px
    pose: np.ndarray  # T_world_camera, 4x4, m
    size: tuple  # columns, rows
    change: object = None  # of the pixels, a function of (image, random numbers); None: the file as it is

    def with_change(self, change, **fields):
        earlier = self.change
        both = change if earlier is None else lambda image, random: change(earlier(image, random), random)
        return dataclasses.replace(self, change=both, **fields)


@dataclasses.dataclass
class Pair:
    stamp: float  # s
    left: View
    right: View

    def with_views(self, change):
        return Pair(self.stamp, change(self.left), change(self.right))

    def swapped(self):
        return Pair(self.stamp, self.right, self.left)


# --- Reading and writing ---------------------------------------------------------------------------------------------

def read_pairs(drive):
    truth = drive.poses if drive.truth.exists() else np.tile(np.eye(4), (len(drive.stamps), 1, 1))
    sides = []
    for side, P in enumerate(drive.projections):
        K = P[:, :3]
        # P = K [I | t]: the camera's centre in the frame of the poses is -t. KITTI's colour cameras have t != 0 left, too.
        T_reference_camera = poses.translation(-np.linalg.solve(K, P[:, 3]))
        size = drives.pixels(drive.path(side, 0)).shape[::-1]
        sides.append([View(drive.path(side, i), K, pose @ T_reference_camera, size) for i, pose in enumerate(truth)])
    return [Pair(*views) for views in zip(drive.stamps, *sides)]


def write_image(view, path, random):
    if view.change is None:
        path.symlink_to(view.path.resolve())
    else:
        cv2.imwrite(str(path), view.change(drives.pixels(view.path), random))


def write_pairs(pairs, known, directory):
    for side in (0, 1):
        (directory / f"image_{side}").mkdir(parents=True)
    for i, pair in enumerate(pairs):
        for side, view in enumerate((pair.left, pair.right)):
            write_image(view, directory / f"image_{side}" / f"{i:06d}.png", np.random.default_rng([i, side]))
    left, right = pairs[0].left, pairs[0].right
    with open(directory / "calib.txt", "w") as file:
        for side, view in enumerate((left, right)):
            # The frame is the left camera's.
            t = -poses.relative(left.pose, view.pose)[:3, 3]
            P = np.column_stack([view.K, view.K @ t])
            print(f"P{side}:", *(f"{value:.12e}" for value in np.where(abs(P) < 1e-9, 0, P).ravel()), file=file)
    np.savetxt(directory / "times.txt", [pair.stamp - pairs[0].stamp for pair in pairs], "%.9f")
    if known:
        poses.write(directory / "poses.txt", [pair.left.pose for pair in pairs])


# --- Guises: functions of a list of pairs that return another one --------------------------------------------------------

def every(step):
    return lambda pairs: pairs[::step]


def backwards(pairs):
    return [dataclasses.replace(pair, stamp=pairs[-1].stamp - pair.stamp) for pair in reversed(pairs)]


def flipped(axes):
    """Flips the columns (x), and the rows (y) as well if so. A flipped image is what the camera sees whose axes are flipped,
    T_world_camera F with F = diag(±1). F is a rotation when both axes are flipped. A single flip is a reflection: then the
    mirrored camera sees a mirrored world, F T_world_camera F, and poses stay rotations. What was right is left then."""
    F = np.diag([-1.0, -1.0 if "y" in axes else 1.0, 1.0, 1.0])
    is_rotation = np.linalg.det(F) > 0
    code = -1 if "y" in axes else 1

    def flip(view):
        K = view.K.copy()
        # Pixel u goes to (columns - 1) - u, and so does the principal point.
        K[0, 2] = view.size[0] - 1 - K[0, 2]
        if "y" in axes:
            K[1, 2] = view.size[1] - 1 - K[1, 2]
        pose = view.pose @ F if is_rotation else F @ view.pose @ F
        return view.with_change(lambda image, random: cv2.flip(image, code), K=K, pose=pose)

    return lambda pairs: [pair.swapped().with_views(flip) for pair in pairs]


def cropped(first, size):
    """Keeps `size` (columns, rows) px from pixel `first` (column, row)."""
    def cut(view):
        K = view.K.copy()
        K[:2, 2] -= first
        window = np.s_[first[1]:first[1] + size[1], first[0]:first[0] + size[0]]
        return view.with_change(lambda image, random: image[window], K=K, size=size)

    return lambda pairs: [pair.with_views(cut) for pair in pairs]


def middle_70(pairs):
    whole = pairs[0].left.size
    size = tuple(int(0.7 * length) for length in whole)
    return cropped([(a - b) // 2 for a, b in zip(whole, size)], size)(pairs)


def half(pairs):
    """Means of 2x2 pixels; an odd last row or column is cut off. A pixel's centre is at an integer, hence the halves."""
    even = tuple(length // 2 * 2 for length in pairs[0].left.size)
    small = tuple(length // 2 for length in even)

    def shrink(view):
        K = view.K.copy()
        K[:2] /= 2
        K[:2, 2] = (view.K[:2, 2] + 0.5) / 2 - 0.5
        return view.with_change(lambda image, random: cv2.resize(image, small, interpolation=cv2.INTER_AREA), K=K, size=small)

    return [pair.with_views(shrink) for pair in cropped((0, 0), even)(pairs)]


def grey_levels(gain, offset, noise):
    """`gain` x level + `offset` and white noise of standard deviation `noise`, clipped to 8 bit."""
    def change(image, random):
        levels = gain * image.astype(float) + offset
        if noise > 0:
            levels += random.normal(0, noise, image.shape)
        return np.uint8(np.clip(np.rint(levels), 0, 255))

    return lambda pairs: [pair.with_views(lambda view: view.with_change(change)) for pair in pairs]


GUISES = {
    "as_recorded": lambda pairs: pairs,
    "every_2nd": every(2), "every_3rd": every(3), "backwards": backwards,
    "mirrored": flipped("x"), "upside_down": flipped("xy"),
    "half": half, "middle_70": middle_70,
    "dark_noise": grey_levels(0.4, 0, 3), "saturated": grey_levels(1.8, 20, 0),
    "light_15": grey_levels(0.15, 0, 0), "light_5": grey_levels(0.05, 0, 0),
    "noise": grey_levels(1, 0, 2), "light_15_noise": grey_levels(0.15, 0, 2), "light_5_noise": grey_levels(0.05, 0, 2),
}


def write_guise(drive, guise, output, first=0, frames=None):
    """Writes pairs `first` … `first + frames - 1` (default: all) of a drive."""
    pairs = read_pairs(drive)[first:][:frames]
    if not pairs:
        sys.exit(f"error: {drive.directory} has no pair {first}")
    write_pairs(GUISES[guise](pairs), drive.truth.exists(), output)


def options(parser):
    parser.add_argument("drive", help=drives.NAMES)
    parser.add_argument("guise", choices=GUISES)
    parser.add_argument("output", type=pathlib.Path, help="a folder that does not exist yet")
    parser.add_argument("--poses", type=pathlib.Path, help="ground truth of the drive [default: its own]")
    parser.add_argument("--first", type=int, default=0, help="first pair to take [default 0]")
    parser.add_argument("--frames", type=int, help="pairs to take [default: all]")


def main(arguments):
    if arguments.output.exists():
        sys.exit(f"error: {arguments.output} exists")
    if arguments.poses and not arguments.poses.exists():
        sys.exit(f"error: {arguments.poses} does not exist")
    drive = drives.named(arguments.drive, arguments.output.resolve().parent)
    if arguments.poses:
        drive = dataclasses.replace(drive, truth=arguments.poses)
    write_guise(drive, arguments.guise, arguments.output, arguments.first, arguments.frames)
