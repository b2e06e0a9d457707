"""Drives in KITTI layout. On every command line a drive is named in one of these ways:

    kitti:06, karlsruhe:19, euroc:MH_01_half   recorded: NAME of the data set in KITTI_DIR, KARLSRUHE_DIR or EUROC_DIR
    hand_held:d435_small:4[:START[:PAIRS]]     rendered: TRAJECTORY:RIG:SEED, first pose and number of pairs
    a folder in KITTI layout                   with poses.txt as its ground truth if that is there"""
import argparse
import contextlib
import dataclasses
import functools
import os
import pathlib
import sys
import tempfile

import cv2
import numpy

from . import poses
from .programs import run

DATA_SETS = {"kitti": "KITTI_DIR", "euroc": "EUROC_DIR", "karlsruhe": "KARLSRUHE_DIR"}
TITLES = {"kitti": "KITTI", "euroc": "EuRoC", "karlsruhe": "Karlsruhe"}
NAMES = "kitti:06, euroc:NAME, karlsruhe:19, TRAJECTORY:RIG:SEED[:START[:PAIRS]] or a folder in KITTI layout"
# Lengths of sub-paths, m.
CAR, SHORT, ROOM, TABLE = "5,10,20,30,40,50", "5,10", "0.5,1,2,3", "0.1,0.2,0.3,0.4,0.5"


@dataclasses.dataclass(frozen=True)
class Drive:
    name: str
    directory: pathlib.Path
    truth: pathlib.Path
    lengths: str = ROOM  # of sub-paths, m

    @functools.cached_property
    def stamps(self):
        return numpy.loadtxt(self.directory / "times.txt", ndmin=1)

    @functools.cached_property
    def projections(self):
        """P0 and P1, 3x4."""
        rows = dict(line.split(":", 1) for line in (self.directory / "calib.txt").read_text().splitlines() if ":" in line)
        return [numpy.array(rows[name].split(), float).reshape(3, 4) for name in ("P0", "P1")]

    @functools.cached_property
    def camera(self):
        """Focal length and principal point, px, and baseline, m."""
        f, _, cx, t, _, _, cy = self.projections[1].ravel()[:7]
        return f, cx, cy, -t / f

    @functools.cached_property
    def poses(self):
        return poses.read(self.truth, len(self.stamps))

    def path(self, side, i):
        return self.directory / f"image_{side}" / f"{i:06d}.png"


def pixels(path):
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        sys.exit(f"error: {path} cannot be read")
    return image


def data_set(kind):
    """Its folder; None where it is not set."""
    return pathlib.Path(os.environ[DATA_SETS[kind]]) if os.environ.get(DATA_SETS[kind]) else None


def recorded(kind, name, folder=None):
    """A sequence of a data set. Raw ones of EuRoC are rectified into `folder`."""
    root = data_set(kind)
    if root is None:
        sys.exit(f"error: {kind}:{name} needs {DATA_SETS[kind]}")
    title = f"{TITLES[kind]} {name}"
    if kind != "euroc":
        # Karlsruhe's ground truth is an inertial system's: good for rotations from pair to pair, not for lengths.
        return Drive(title, root / "sequences" / name, root / "poses" / f"{name}.txt", SHORT if kind == "karlsruhe" else CAR)
    directory, lengths = root / name, ROOM
    if (directory / "mav0").exists():
        raw, directory, lengths = directory / "mav0", folder / name, TABLE
        if not directory.exists():
            run("convert", raw, "--output", directory)
    return Drive(title, directory, directory / "poses.txt", lengths)


def rendered(folder, trajectory, rig, seed, start=0, pairs=120, lengths=ROOM, name=None, **options):
    """A rendered drive, kept in `folder` under a name that has everything in it but the renderer's version, unless another one is
    given. `options` are those of render_drive, such as noise=2."""
    words = {name.replace("_", "-"): str(value) for name, value in options.items()}
    name = name or "_".join(map(str, [pathlib.Path(trajectory).stem, rig, seed, start, pairs, *(f"{word}{value}" for word, value in words.items())]))
    directory = folder / name
    if not (directory / "poses.txt").exists():
        run("render_drive", "--trajectory", trajectory, "--rig", rig, "--seed", seed, "--start", start, "--frames", pairs,
            *(part for word, value in words.items() for part in ("--" + word, value)), "--output", directory)
    return Drive(f"{trajectory}, {rig}, seed {seed}", directory, directory / "poses.txt", lengths)


def named(text, folder, **options):
    """A drive by its name; `options` as for `rendered`, where the name leaves them open."""
    kind, _, rest = text.partition(":")
    if kind in DATA_SETS and rest:
        return recorded(kind, rest, folder)
    fields = text.split(":")
    if 3 <= len(fields) <= 5 and all(field.isdigit() for field in fields[2:]):
        options.update(zip(("seed", "start", "pairs"), map(int, fields[2:])))
        return rendered(folder, *fields[:2], **options)
    directory = pathlib.Path(text).resolve()
    if not (directory / "calib.txt").exists():
        sys.exit(f"error: {text} is no drive: it has no calib.txt, nor is it KITTI's, EuRoC's, Karlsruhe's or TRAJECTORY:RIG:SEED")
    return Drive(directory.name, directory, directory / "poses.txt")


def recorded_names(kind):
    """Names of the data set's drives that are long enough to measure."""
    root = data_set(kind)
    if root is None:
        print(f"WARNING: {DATA_SETS[kind]} is not set, its drives are left out", file=sys.stderr)
        return []
    if kind == "euroc":
        return [path.name for path in sorted(root.iterdir()) if path.name.endswith("moving") or (path / "calib.txt").exists()]
    return [path.name for path in sorted((root / "sequences").iterdir()) if len((path / "times.txt").read_text().split()) >= 20]


def add_rendered(parser):
    parser.add_argument("--rendered", type=pathlib.Path, metavar="FOLDER",
                        help="keeps rendered drives there, or takes those that are there [default: none is kept]")


@contextlib.contextmanager
def folders(arguments: argparse.Namespace):
    """A folder for what is thrown away, and that for rendered drives."""
    with tempfile.TemporaryDirectory() as work:
        folder = (arguments.rendered or pathlib.Path(work) / "rendered").resolve()
        folder.mkdir(parents=True, exist_ok=True)
        yield pathlib.Path(work), folder
