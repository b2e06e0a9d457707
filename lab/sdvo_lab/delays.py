"""Right cameras that are late or early, on rendered drives of exact truth: is the delay found, and is the pose within its covariance?

    lab/run delays
    lab/run delays --seed 100 --write    # the same drives in other worlds"""
import numpy

from . import drives, marks, odometry, poses

# Trajectory, rig, seed, delay of the right camera in ms, pairs. Mechanisms were tuned on other seeds (lab/docs/rendered_drives.md).
DRIVES = [("hand_held", "d435_small", 91, -3.1, 100), ("hand_held", "d435_small", 92, -3.1, 100), ("hand_held", "d435_small", 91, 6.2, 100),
          ("hand_held", "d435_small", 91, 15.6, 100), ("hand_held", "d435_small", 625, 15.6, 100), ("turn_in_place", "d435_small", 94, 3.1, 100),
          ("turn_in_place", "d435_small", 624, 3.1, 100), ("figure_eight", "kitti", 95, 3.1, 50), ("hand_held", "d435_small", 921, 25, 105),
          ("hand_held", "d435_small", 922, 25, 105), ("hand_held", "d435_small", 921, 10, 105), ("hand_held", "d435_small", 921, 0, 105),
          ("hand_held", "d435", 923, 17, 105)]


def row(drive, delay):
    run, truth = odometry.run(drive.directory), drive.poses
    true, last = poses.relative(truth[0], truth[-1]), run.states[-1]
    error = poses.logarithm(poses.relative(run.poses[-1], true))
    length = numpy.linalg.norm(numpy.diff(truth[:, :3, 3], axis=0), axis=1).sum()
    found = "{:.2f} ± {:.2f}".format(*(float(run.timing[-1][name]) for name in ("right_delay_ms", "right_delay_sigma_ms")))
    return [delay, f"{sum(state.state == 'TRACKING' for state in run.states)} of {len(run.states)}",
            f"{numpy.linalg.norm(error[:3]):.3f} of {length:.1f}", f"{max(poses.sigmas(error, last.pose)):.1f}", found]


def rows(folder, seed):
    yield ["drive", "rig", "seed", "delay [ms]", "pairs TRACKING", "error at the end [m]", "[sigma]", "found [ms]"]
    for trajectory, rig, own, delay, pairs in DRIVES:
        drive = drives.rendered(folder, trajectory, rig, own + seed, pairs=pairs, right_delay=round(delay / 1e3, 6))
        yield [trajectory, rig, own + seed, *row(drive, delay)]


def options(parser):
    parser.add_argument("--seed", type=int, default=0, help="added to the drives' seeds [default 0]")
    drives.add_rendered(parser)
    marks.add_write(parser, marks.RENDERED)


def main(arguments):
    with drives.folders(arguments) as (_, folder):
        marks.show(rows(folder, arguments.seed), arguments.write, "delays")
