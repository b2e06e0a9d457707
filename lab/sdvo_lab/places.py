"""Which revisits are recognised, what is a false loop and what drift is taken back, on long rendered drives along KITTI's ways
and on the recorded ones: the table of lab/docs/places.md. The rendered ones also as if of cameras with a focal length 1 % longer: turns come
out too small."""
import re
import tempfile

import numpy

from . import accuracy, drives, marks, programs


def with_wrong_focal_length(drive, work):
    directory = work / f"{drive.directory.name}_focal"
    directory.mkdir()
    for name in ("image_0", "image_1", "times.txt"):
        (directory / name).symlink_to(drive.directory / name)
    with open(directory / "calib.txt", "w") as file:
        for side, P in enumerate(drive.projections):
            print(f"P{side}:", *(P * numpy.array([[1.01, 1, 1, 1], [1, 1.01, 1, 1], [1, 1, 1, 1]])).ravel(), file=file)
    return directory


def recognise(name, directory, truth):
    with tempfile.TemporaryDirectory() as work:
        said = programs.run("run_sequence", directory, "--places", "--ground-truth", truth, "--poses", f"{work}/poses.txt", "--keyframes", f"{work}/keyframes.csv")
    pairs, length = re.search(r"(\S+) pairs, (\S+) m, ", said).groups()
    longest, cpu = re.search(r"longest optimisation (\S+) ms; CPU per pair, all included, (\S+) ms", said).groups()
    *counts, t, r = re.search(r"revisits (\S+), recognised (\S+); loops (\S+), false (\S+), worst (\S+) m (\S+) deg", said).groups()
    before, after = re.search(r"ATE before (\S+) m, after (\S+) m", said).groups()
    return [name, pairs, f"{float(length):.0f}", *counts, f"{t} m, {r}°", f"{before} → {after}", cpu, longest]


OF_THE_PAGE = 9  # columns


def rows(work, folder, frames):
    yield ["drive", "pairs", "m", "revisits", "recognised", "loops", "false", "worst loop", "ATE [m]", "CPU [ms a pair]",
           "longest optimisation [ms]"]
    for way, pairs, seed in accuracy.LONG:
        drive = accuracy.along(folder, way, frames or pairs, seed)
        yield recognise(f"along {way}", drive.directory, drive.truth)
        yield recognise(f"along {way}, focal length + 1 %", with_wrong_focal_length(drive, work), drive.truth)
    for name in drives.recorded_names("kitti"):
        drive = drives.recorded("kitti", name)
        yield recognise(f"KITTI {name}, real", drive.directory, drive.truth)


def options(parser):
    parser.add_argument("--frames", type=int, help="pairs of each rendered drive [default: all]")
    drives.add_rendered(parser)
    marks.add_write(parser, marks.PLACES)


def main(arguments):
    of_page = []
    with drives.folders(arguments) as (work, folder):
        marks.show(of_page.append(row[:OF_THE_PAGE]) or row for row in rows(work, folder, arguments.frames))
    if arguments.write:
        marks.put(arguments.write, "places", marks.lines(of_page))
