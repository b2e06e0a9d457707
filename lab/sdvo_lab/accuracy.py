"""Measures the errors of the present build and prints them as tables of docs/precision.md; some minutes, most of them to render:

    lab/run accuracy                                 # drives, guises and robots
    lab/run accuracy drives --record                 # recorded drives, and what changed since lab/docs/accuracy.csv, which is then written
    lab/run accuracy guises robots --write           # puts tables, all but `still`, between the marks of lab/docs/faults.md and docs/precision.md

drives: every sequence of the data sets that has a ground truth. guises: some of them, and a rendered one, turned, cut, spoilt
and in other orders (lab/run guises). robots: rendered drives of small rigs. long: rendered drives of 0.7 to 2.5 km along KITTI's ways,
and a minute each of robots, an hour or more. still: how far the odometry walks while a rendered rig stands for a minute."""
import csv
import dataclasses
import re

import numpy

from . import drives, marks, odometry, poses, programs
from .drives import ROOM, TABLE
from .guises import GUISES, write_guise

RECORD = programs.ROOT / "lab/docs/accuracy.csv"
EFFECTS = {"noise": 2, "exposure": 0.3, "motion_blur": 0.01}
# Rendered drives of robots: trajectory, rig, seed, first pose, pairs, lengths. A corridor's first corner comes after 7 s or more.
ROBOTS = [(trajectory, rig, seed, start, pairs, lengths) for trajectory, rigs, seeds, start, pairs, lengths in (
    ("hover", ("d435_small", "d435"), (1, 2), 0, 120, ROOM),
    ("hand_held", ("d435_small", "zed_mini"), (1,), 20, 120, ROOM),
    ("turn_in_place", ("d435_small",), (1,), 0, 160, TABLE),
    ("corridor", ("d435_small",), (1,), 130, 160, ROOM),
    ("desk", ("d435_small", "oak_d"), (1,), 20, 100, TABLE)) for rig in rigs for seed in seeds]

# Rendered drives along KITTI's ways: name, pairs, seed; and minutes of robots, 20 pairs a second: trajectory, rig, seed.
LONG = [("06", 1101, 4), ("07", 1101, 5), ("00", 1700, 1), ("05", 1600, 2), ("09", 1591, 3), ("01", 1101, 6)]
MINUTES = [("hand_held", "d435_small", 11), ("turn_in_place", "d435_small", 12), ("corridor", "zed_mini", 13), ("desk", "oak_d", 14)]
LONG_EFFECTS = {"noise": 2, "exposure": 0.3, "moving_share": 0.02}


@dataclasses.dataclass
class Errors:
    t: float         # %
    r: float         # deg/m
    pair: float      # deg, from pair to pair
    scale: float
    cpu: str         # ms a pair
    options: str     # their hash
    pairs: int
    not_tracking: int
    lost: int
    refused: int     # by the rig monitor: without a feature


def measure(drive, extra):
    run = odometry.run(drive.directory, *extra)
    errors = odometry.errors(drive.truth, run.poses, drive.lengths)
    states = [row["state"] for row in run.timing]
    return Errors(errors["mean"]["translation_percent"], errors["mean"]["rotation_deg_per_m"], errors["rpe_rotation_deg"],
                  errors["scale"], re.search(r"CPU ([\d.]+)", run.said)[1], re.search(r"^options (\S+)", run.said, re.MULTILINE)[1],
                  len(states), sum(state != "TRACKING" for state in states), states.count("LOST"),
                  sum(row["features"] == "0" for row in run.timing))


def recorded_table(work, extra, record, page):
    yield ["sequence", "t [%]", "r [deg/m]", "pair to pair [deg]", "change of these", "scale", "not tracked", "CPU ms per pair", "options"]
    before = {}
    if RECORD.exists():
        with open(RECORD) as file:
            before = {row["sequence"]: row for row in csv.DictReader(file)}
    rows = ["sequence,t_percent,r_deg_per_m,pair_to_pair_deg,not_tracked,options"]
    of_page = [["sequence", "pairs", "translation [%]", "rotation [deg/m]", "rotation from pair to pair, rms [deg]", "not TRACKING"]]
    for kind in drives.DATA_SETS:
        for name in drives.recorded_names(kind):
            drive = drives.recorded(kind, name, work)
            e, last, change = measure(drive, extra), before.get(drive.name), ""
            if last:
                change = (f"{e.t - float(last['t_percent']):+.3f}, {e.r - float(last['r_deg_per_m']):+.5f}, "
                          f"{e.pair - float(last['pair_to_pair_deg']):+.4f}")
            yield [drive.name, f"{e.t:.3f}", f"{e.r:.5f}", f"{e.pair:.4f}", change, f"{e.scale:.5f}", e.not_tracking, e.cpu, f"`{e.options}`"]
            means = ["–", "–"] if kind == "karlsruhe" else [f"{e.t:.3f}", f"{e.r:.4f}"]  # lengths of its truth are wrong
            of_page.append([drive.name, e.pairs, *means, f"{e.pair:.3f}", e.not_tracking])
            rows.append(f"{drive.name},{e.t:.4f},{e.r:.5f},{e.pair:.5f},{e.not_tracking},{e.options}")
    if record:
        RECORD.write_text("\n".join(rows) + "\n")
    if page:
        marks.put(page, "errors", marks.lines(of_page))


def in_guise(drive, guise, work, extra):
    directory = work / f"{drive.directory.name}_{guise}"
    write_guise(drive, guise, directory)
    return measure(dataclasses.replace(drive, directory=directory, truth=directory / "poses.txt"), extra)


def robot(folder, trajectory, rig, seed, start, pairs, lengths):
    return drives.rendered(folder, trajectory, rig, seed, start, pairs, lengths, **EFFECTS)


def guise_table(work, folder, extra):
    """Rows are guises, columns drives."""
    chosen = [drives.recorded(kind, name, work) for kind, name in (("kitti", "06"), ("euroc", "MH_01_moving"), ("euroc", "MH_01_half"))
              if drives.data_set(kind)]
    chosen.append(robot(folder, *next(found for found in ROBOTS if found[:2] == ("hand_held", "d435_small"))))
    yield ["guise", *(drive.name for drive in chosen)]
    with programs.pool() as pool:
        results = {guise: [pool.submit(in_guise, drive, guise, work, extra) for drive in chosen] for guise in GUISES}
        for guise, row in results.items():
            yield [guise.replace("_", " "), *(f"{e.t:.2f}/{e.r:.4f}, {e.not_tracking}, {e.lost}, {e.refused}"
                                              for e in (result.result() for result in row))]


def robot_table(folder, extra):
    yield ["drive", "pairs", "t [%]", "r [deg/m]", "not TRACKING", "LOST", "rejected by the rig monitor"]
    for fields in ROBOTS:
        drive = robot(folder, *fields)
        e = measure(drive, extra)
        yield [drive.name, e.pairs, f"{e.t:.2f}", f"{e.r:.4f}", e.not_tracking, e.lost, e.refused]


def along(folder, way, pairs, seed, lengths="100,200,300,400,500,600,700,800"):
    poses_file = drives.data_set("kitti") / "poses" / f"{way}.txt"
    return drives.rendered(folder, poses_file, "kitti", seed, 0, pairs, lengths, **LONG_EFFECTS)


def long_table(folder, extra, frames):
    yield ["drive", "pairs", "m", "translation [%]", "rotation [deg/m]", "at the end [m]", "[% of length]", "pairs not tracked"]
    chosen = [(f"along KITTI {way}", along(folder, way, frames or pairs, seed, *(["5,10,20"] if frames else []))) for way, pairs, seed in LONG]
    chosen += [(f"{path}, {rig}", drives.rendered(folder, path, rig, seed, 0, frames or 1200, "0.5,1,2,5,10", motion_blur=0.01, **LONG_EFFECTS))
               for path, rig, seed in MINUTES]
    for name, drive in chosen:
        run = odometry.run(drive.directory, *extra)
        e = odometry.errors(drive.truth, run.poses, drive.lengths)
        yield [name, e["frames"], f"{e['path_length_m']:.0f}", f"{e['mean']['translation_percent']:.4f}",
               f"{e['mean']['rotation_deg_per_m']:.5f}", f"{e['final_drift_m']:.4f}", f"{e['final_drift_percent']:.4f}",
               sum(state.state != "TRACKING" for state in run.states)]


def still_table(folder, extra, frames):
    yield ["pairs", "largest way [mm]", "[deg]", "at the end [mm]", "[deg]"]
    drive = drives.rendered(folder, "still", "kitti", 1, 0, frames or 600, **LONG_EFFECTS)
    walked = [poses.logarithm(pose) for pose in odometry.run(drive.directory, *extra).poses]
    ways = numpy.array([[1e3 * numpy.linalg.norm(xi[:3]), numpy.degrees(numpy.linalg.norm(xi[3:]))] for xi in walked])
    yield [len(ways), *(f"{value:.{digits}f}" for way in (ways.max(axis=0), ways[-1]) for value, digits in zip(way, (1, 4)))]


def options(parser):
    parser.add_argument("tables", nargs="*", metavar="drives|guises|robots|long|still", help="[default: the first three]")
    programs.add_params(parser)
    parser.add_argument("--frames", type=int, help="pairs of each drive [default: all]")
    parser.add_argument("--record", action="store_true", help="writes lab/docs/accuracy.csv")
    marks.add_write(parser, marks.ACCURACY)
    drives.add_rendered(parser)


def main(arguments):
    extra = programs.params(arguments) + (["--frames", str(arguments.frames)] if arguments.frames else [])
    with drives.folders(arguments) as (work, folder):
        tables = {"drives": lambda: recorded_table(work, extra, arguments.record, arguments.write),
                  "guises": lambda: guise_table(work, folder, extra), "robots": lambda: robot_table(folder, extra),
                  "long": lambda: long_table(folder, extra, arguments.frames), "still": lambda: still_table(folder, extra, arguments.frames)}
        marks.check_names(arguments.tables, tables)
        pages = {"guises": marks.FAULTS, "robots": marks.ACCURACY, "long": marks.ACCURACY}
        for name in arguments.tables or ("drives", "guises", "robots"):
            marks.show(tables[name](), pages.get(name) if arguments.write else None, name)
