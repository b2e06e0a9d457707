"""Holds the self-checks of run_sequence against the ground truth, and prints the tables of docs/precision.md; some ten minutes, most of
them to render drives.

rendered: drives whose ground truth is exact. recorded: sequences of KITTI, where KITTI_DIR is set. Both errors are the mean over all
sub-paths of a tenth of the distance: the errors that --shuttle and --halves imply, and the error against the ground truth."""
import csv
import pathlib
import statistics
import tempfile

from . import drives, marks, odometry, programs

EFFECTS = {"noise": 2, "exposure": 0.3}
SEEDS = (71, 72)
# Trajectory, rig, first pair: where a robot starts from rest, it has set off by then.
DRIVES = [("figure_eight", "kitti", 0), ("hover", "euroc", 0), ("hand_held", "d435_small", 20), ("corridor", "zed_mini", 60),
          ("desk", "oak_d", 20), ("turn_in_place", "d435_small", 0)]
PAIRS = 240
SEQUENCES = ("01", "03", "04", "06")
CHECKS = ("halves", "shuttle")
LARGER = "the larger one"


def measure(drive, extra):
    """Rows of the self-checks by name, and the true errors of the same sub-paths, in % and in deg/m, or None."""
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        programs.run("run_sequence", drive.directory, "--output", work, "--format", "kitti", "--shuttle", "--halves", *extra)
        name = drive.directory.name
        with open(work / f"{name}.self_check.csv") as file:
            checks = {row["check"]: row for row in csv.DictReader(file)}
        length = next((row["sub_path_m"] for row in checks.values() if row["sub_path_m"]), None)
        mean = odometry.errors(drive.truth, work / f"{name}.txt", length)["mean"] if length else {}
    return checks, mean.get("translation_percent"), mean.get("rotation_deg_per_m")


def drive_rows(measured, ratios, without):
    """Rows of the drives; gathers estimates by true errors, and the number of drives without a figure."""
    yield ["drive", "m", "true t [%]", "halves", "shuttle", "true r [deg/m]", "halves", "shuttle"]
    for drive, (checks, *true) in measured:
        cells = {}
        has_figure = {check: bool(checks[check]["error_percent"]) for check in CHECKS}
        for check, row in checks.items():
            for kind, column, truth, digits in zip("tr", ("error_percent", "error_deg_per_m"), true, (3, 4)):
                if has_figure[check]:
                    ratios[check, kind].append(float(row[column]) / truth)
                    cells[check, kind] = f"{float(row[column]):.{digits}f} ({ratios[check, kind][-1]:.2f})"
                else:
                    cells[check, kind] = "none: " + (row["problem"] or "the camera stands")
            without[check] += not has_figure[check]
        if all(has_figure.values()):
            for kind in "tr":
                ratios[LARGER, kind].append(max(ratios[check, kind][-1] for check in CHECKS))
        else:
            without[LARGER] += 1
        t, r = ("–" if truth is None else f"{truth:.{digits}f}" for truth, digits in zip(true, (3, 4)))
        yield [drive.name, f"{float(checks['halves']['distance_m']):.1f}", t, *(cells[check, "t"] for check in CHECKS),
               r, *(cells[check, "r"] for check in CHECKS)]


def ratio_rows(ratios, without):
    yield ["estimate/true", "within a factor of two", "smallest", "median", "largest", "no figure"]
    for (check, kind), values in ratios.items():
        cells = ["–"] * 4
        if values:
            cells = [f"{sum(0.5 <= value <= 2.0 for value in values)} of {len(values)}",
                     *(f"{of(values):.2f}" for of in (min, statistics.median, max))]
        yield [f"{check}, {'translation' if kind == 't' else 'rotation'}", *cells, without[check]]


def show(name, chosen, arguments):
    ratios = {(check, kind): [] for check in (*CHECKS, LARGER) for kind in "tr"}
    without = dict.fromkeys((*CHECKS, LARGER), 0)
    measured = ((drive, measure(drive, programs.params(arguments))) for drive in chosen)
    marks.show(drive_rows(measured, ratios, without))
    print()
    marks.show(ratio_rows(ratios, without), arguments.write if name == "rendered" else None, name)
    print()


def options(parser):
    parser.add_argument("tables", nargs="*", metavar="rendered|recorded", help="[default: both]")
    programs.add_params(parser)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS, help="of the rendered drives [default: %(default)s]")
    parser.add_argument("--pairs", type=int, default=PAIRS, help="of each drive [default: %(default)s]")
    parser.add_argument("--only", nargs="+", metavar="TRAJECTORY", default=[], help="drives to render [default: all]")
    parser.add_argument("--sequences", nargs="+", default=SEQUENCES, help="of KITTI [default: %(default)s]")
    drives.add_rendered(parser)
    marks.add_write(parser, marks.SELF_CHECK)


def main(arguments):
    marks.check_names(arguments.tables, ("rendered", "recorded"))
    marks.check_names(arguments.only, [drive[0] for drive in DRIVES])
    tables = arguments.tables or ["rendered", "recorded"]
    with drives.folders(arguments) as (_, folder):
        if "rendered" in tables:
            show("rendered", (drives.rendered(folder, trajectory, rig, seed, start, arguments.pairs, **EFFECTS)
                              for trajectory, rig, start in DRIVES if not arguments.only or trajectory in arguments.only
                              for seed in arguments.seeds), arguments)
        if "recorded" in tables and drives.data_set("kitti"):
            show("recorded", (drives.recorded("kitti", name) for name in arguments.sequences), arguments)
