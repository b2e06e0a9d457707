"""Rolling shutters on rendered drives of exact truth, against a global one: ignored, estimated while driving, and known beforehand.

    lab/run shutters
    lab/run shutters --seed 100 --write    # the same drives in other worlds

Errors are those after the first seconds, in which an unknown readout is found."""
import collections

import numpy

from . import drives, marks, odometry

# Trajectory, rig, seed, readout in ms, pairs, lengths of sub-paths.
DRIVES = [("hand_held", "d435_small", 8403, 5, 160, drives.ROOM), ("hand_held", "d435_small", 8401, 10, 160, drives.ROOM),
          ("hand_held", "d435_small", 8402, 25, 160, drives.ROOM), ("hand_held", "d435_small", 8404, 33, 160, drives.ROOM),
          ("hand_held", "d435", 8405, 17, 160, drives.ROOM), ("hover", "d435_small", 8406, 25, 160, drives.ROOM),
          ("figure_eight", "kitti", 8407, 25, 120, drives.CAR)]
FIRST = 3.0  # s, left out
IGNORED = 1e-6  # s: told that the shutter is all but global

Errors = collections.namedtuple("Errors", "translation rotation beyond estimate")


def measure(drive, *params):
    """Errors after FIRST s: t in %, r in deg/m; motions of all pairs that are TRACKING beyond 5 sigma; and what is estimated."""
    run, truth = odometry.run(drive.directory, *params), drive.poses
    first = int(numpy.searchsorted(drive.stamps, drive.stamps[0] + FIRST))
    found = odometry.errors(truth[first:], run.poses[first:], drive.lengths)["mean"]
    return Errors(found["translation_percent"], found["rotation_deg_per_m"], sum(is_wrong for _, is_wrong in odometry.motion_errors(run, truth)),
                  "{:.1f} ± {:.1f}".format(*(float(run.timing[-1][name]) for name in ("readout_ms", "readout_sigma_ms"))))


def rows(folder, seed):
    yield ["drive", "rig", "seed", "readout [ms]", "found [ms]", "global", "ignored", "estimated", "known", "beyond 5 sigma: ignored, estimated, known"]
    for trajectory, rig, own, readout, pairs, lengths in DRIVES:
        still, rolled = (drives.rendered(folder, trajectory, rig, own + seed, pairs=pairs, lengths=lengths, readout=value) for value in (0, readout / 1e3))
        results = [measure(still)] + [measure(rolled, *words) for words in (
            ("--param", f"calibration/readout={IGNORED}"), (), ("--param", f"calibration/readout={readout / 1e3}"))]
        yield [trajectory, rig, own + seed, readout, results[2].estimate, *(f"{each.translation:.2f}, {each.rotation:.3f}" for each in results),
               ", ".join(str(each.beyond) for each in results[1:])]


def options(parser):
    parser.add_argument("--seed", type=int, default=0, help="added to the drives' seeds [default 0]")
    drives.add_rendered(parser)
    marks.add_write(parser, marks.RENDERED)


def main(arguments):
    with drives.folders(arguments) as (_, folder):
        marks.show(rows(folder, arguments.seed), arguments.write, "shutters")
