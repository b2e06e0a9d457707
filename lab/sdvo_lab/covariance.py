"""Compares the odometry's covariances with its errors on undisturbed rendered drives, whose truth is exact. The measure is the
NEES, the error's square in standard deviations of all six numbers, whose mean is 6 where covariances are honest.

    lab/run covariance                # all drives of DRIVES
    lab/run covariance --seed 500     # the same drives in other worlds
    lab/run covariance --write --picture docs/images/errors_in_sigmas.png"""
import pathlib

import numpy

from . import bootstrap, drives, marks, odometry, poses, programs

# Trajectory, rig, pairs a second, pairs, first pose.
DRIVES = [("city_loop", "kitti", 10, 300, 0), ("figure_eight", "kitti", 10, 300, 0), ("hover", "euroc", 20, 300, 60),
          ("hand_held", "d435", 20, 300, 40), ("hand_held", "d435_small", 20, 300, 20), ("hand_held", "oak_d", 20, 300, 60),
          ("corridor", "d435_small", 20, 200, 100), ("turn_in_place", "oak_d", 20, 200, 0), ("desk", "d435_small", 20, 200, 20),
          ("still", "kitti", 10, 100, 0), ("still", "euroc", 10, 100, 0), ("still", "d435_small", 10, 100, 0)]
SETTLED = 10  # pairs of a standing camera until the first key frame's own noise is out of the motions


def measure(drive, extra):
    """Squares of the motions' errors while TRACKING and of the poses' errors, in standard deviations, and the number of
    pairs that were not TRACKING."""
    run, truth = odometry.run(drive.directory, *extra), drive.poses
    motions, of_poses, last = [], [], 0
    for i, state in enumerate(run.states):
        if state.moved and state.state == "TRACKING":
            motion, true = (poses.relative(stack[last], stack[i]) for stack in (run.poses, truth))
            motions.append(poses.square(poses.logarithm(poses.relative(motion, true)), state.motion))
            true = poses.relative(truth[0], truth[i])
            of_poses.append(poses.square(poses.logarithm(poses.relative(run.poses[i], true)), state.pose))
        if state.has_pose:  # the next motion begins here
            last = i
    others = sum(state.state != "TRACKING" for state in run.states)
    return motions[SETTLED if drive.name.startswith("still") else 0:], of_poses, others


def draw(path, moving, standing):
    from . import pictures
    figure, axes = pictures.plt.subplots(figsize=(6.4, 3.2))
    bins = numpy.linspace(0, 7, 36)
    for name, squares in (("driving", moving), ("standing", standing)):
        axes.hist(numpy.sqrt(squares), bins, density=True, histtype="step", label=f"{name}, {len(squares)} pairs")
    r = numpy.linspace(0, 7, 200)
    axes.plot(r, r ** 5 * numpy.exp(-r * r / 2) / 8, "k--", linewidth=1, label="honest: chi of six")
    axes.set(xlabel="error of a motion, standard deviations of all six numbers", ylabel="density")
    axes.legend()
    pictures.save(figure, path)


def rows(names, results):
    yield ["drive", "rig", "pairs", "motion NEES", "largest [sigma]", "pose NEES", "not TRACKING"]
    for (trajectory, rig, _, pairs, _), (motions, of_poses, others) in zip(names, results):
        yield [trajectory, rig, pairs, f"{numpy.mean(motions):.1f}", f"{max(motions) ** 0.5:.1f}", f"{numpy.mean(of_poses):.1f}", others]
    for name, some in split(names, results).items():
        cells = []
        for column in (0, 1):
            means = [float(numpy.mean(result[column])) for result in some]
            cells.append("{:.1f} [{:.1f}, {:.1f}]".format(bootstrap.mean(means), *bootstrap.interval(means)) if means else "–")
        yield [f"**{name}**, mean of drives [95 %]", "", "", cells[0], "", cells[1], ""]


def split(names, results):
    return {word: [result for name, result in zip(names, results) if (name[0] == "still") == still]
            for word, still in (("driving", False), ("standing", True))}


def options(parser):
    parser.add_argument("--only", nargs="+", metavar="TRAJECTORY", help="drives of DRIVES [default: all]")
    parser.add_argument("--seed", type=int, default=300, help="of the first drive; the next ones count on [default %(default)s]")
    programs.add_params(parser)
    drives.add_rendered(parser)
    marks.add_write(parser, marks.FAULTS)
    parser.add_argument("--picture", type=pathlib.Path, help="PNG of the errors' distribution to write")


def main(arguments):
    marks.check_names(arguments.only or [], [drive[0] for drive in DRIVES])
    chosen = [(k, drive) for k, drive in enumerate(DRIVES) if not arguments.only or drive[0] in arguments.only]

    def result(of):
        k, (trajectory, rig, rate, pairs, start) = of
        return measure(drives.rendered(folder, trajectory, rig, arguments.seed + k, start, pairs, rate=rate, noise=2, exposure=0.3),
                       programs.params(arguments))

    with drives.folders(arguments) as (_, folder), programs.pool() as pool:
        results = list(pool.map(result, chosen))
    names = [drive for _, drive in chosen]
    marks.show(rows(names, results), arguments.write, "covariances")
    if arguments.picture:
        draw(arguments.picture, *(sum((result[0] for result in some), []) for some in split(names, results).values()))
