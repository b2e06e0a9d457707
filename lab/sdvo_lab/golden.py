"""Keeps what the odometry says of drives, and compares two builds by it: poses, states and covariances of every pair.

    lab/run golden record DIR DRIVE [DRIVE …]    # another build's: TOOLS=DIRECTORY, where its run_sequence is
    lab/run golden compare BEFORE AFTER          # exits 1 where anything differs
    lab/run golden digest                        # one number of all that, for the first pairs of three recorded drives
    lab/run golden count                         # numbers of src/odometry"""
import hashlib
import pathlib
import re
import sys
import tempfile

import numpy

from . import drives, marks, odometry, poses, programs


def record(directory, names):
    directory = pathlib.Path(directory).resolve()
    directory.mkdir(parents=True, exist_ok=True)

    def run(name):
        drive = drives.named(name, directory / "drives")
        base = directory / "_".join(drive.directory.parts[-2:])
        programs.run("run_sequence", drive.directory, "--poses", f"{base}.txt", "--states", f"{base}.csv")

    with programs.pool() as pool:
        list(pool.map(run, names))


# Three cameras, and pairs until the map is full of key frames.
DIGESTED, PAIRS = ("kitti:06", "euroc:MH_01_half", "karlsruhe:19"), 30


def numbers(state, pose):
    """Of a pair: its pose, and standard deviations and correlations of motion and pose; rounded, as the last bits depend on the compiler."""
    yield from numpy.round(pose[:3].ravel(), 8) + 0.0  # no negative zero
    for covariance in (state.motion, state.pose):
        sigmas = numpy.sqrt(numpy.diag(covariance))
        yield from (float(f"{sigma:.5e}") for sigma in sigmas)
        yield from numpy.round((covariance / numpy.outer(sigmas, sigmas) if sigmas.all() else covariance).ravel(), 5) + 0.0


def digest():
    """SHA-256, the same where states, poses and covariances are. The words of a reason do not count."""
    found = hashlib.sha256()
    with tempfile.TemporaryDirectory() as work:
        for name in DIGESTED:
            run = odometry.run(drives.named(name, pathlib.Path(work)).directory, "--frames", str(PAIRS))
            for state, pose in zip(run.states, run.poses):
                found.update(f"{state.state} {state.epoch} {state.moved} {[float(x) for x in numbers(state, pose)]}\n".encode())
    return found.hexdigest()


def read(directory, name):
    states = odometry.read_states(directory / f"{name}.csv")
    traces = numpy.array([[numpy.trace(covariance) for covariance in (state.motion, state.pose)] for state in states])
    return [state.state for state in states], poses.read(directory / f"{name}.txt"), traces


def differences(before, after, names):
    yield ["drive", "pairs", "other states", "largest difference of poses [mm]", "[mrad]", "motion covariance, ratio of traces, median",
           "pose covariance"]
    for name in names:
        (states, truth, traces), (states2, estimate, traces2) = read(before, name), read(after, name)
        common = min(len(states), len(states2))
        others = sum(a != b for a, b in zip(states, states2)) + abs(len(states) - len(states2))
        gap = truth[:common] - estimate[:common]
        apart = numpy.linalg.norm(gap[:, :3, 3], axis=1).max()
        turned = numpy.linalg.norm(gap[:, :3, :3].reshape(common, 9), axis=1).max() / 2 ** 0.5
        a, b = traces[:common], traces2[:common]
        ratios = numpy.nanmedian(numpy.where(a > 0, b / numpy.where(a > 0, a, 1), numpy.nan), axis=0)
        yield [name, len(states), others, f"{1e3 * apart:.3f}", f"{1e3 * turned:.3f}", *(f"{ratio:.3f}" for ratio in ratios)]


def compare(before, after):
    before, after = pathlib.Path(before), pathlib.Path(after)
    names = sorted(path.stem for path in before.glob("*.csv") if (after / path.name).exists())
    if not names:
        sys.exit(f"error: {before} and {after} have no drive in common")
    marks.show(differences(before, after, names))
    return any((before / name).read_bytes() != (after / name).read_bytes()
               for stem in names for name in (f"{stem}.csv", f"{stem}.txt"))


# Named constants that no one would tune: sizes of the machine's words and of arrays, mathematics, and guards against
# rounding, whose value changes no result by more than rounding does.
FIXED = set("""
    kBlock kBytes kCalibration kInfinity kLanes kLargestRadius kLargestSampledSide kMostSampled kNone kParameters kRow
    kMedianOfChiSquare kSmallestProblem kX kY kZ
    kBehindSquare kFarFromOverflow kHeld kNearestScaled kPrior kSmallestGain kSmallestStep kSteps""".split())

# Of the motion side, from the ground.
ROOMS = ("motion", "matching", "map", "belief", "rig", "odometry")


def count():
    """Numbers that change results, options by their list.add and constants by their names; bare literals are not counted."""
    sources = [path for room in ROOMS
               for path in (*programs.ROOT.glob(f"src/{room}/*.[ch]pp"),
                            *programs.ROOT.glob(f"include/stereo_descriptor_vo/{room}/*.hpp"))]
    texts = [path.read_text() for path in sources]
    settings = sum(len(re.findall(r"list\.add\(", text)) for text in texts)
    names = [name for text in texts for name in re.findall(r"\b(k[A-Z]\w*) = ", text)]
    fixed = sum(name in FIXED for name in names)
    print(f"{settings} options, {len(names) - fixed} named constants, {fixed} more that change nothing, "
          f"{sum(text.count(chr(10)) for text in texts)} lines in {len(sources)} files of the odometry")


def options(parser):
    actions = parser.add_subparsers(dest="action", metavar="record|compare|digest|count")
    actions.required = True
    action = actions.add_parser("record", help="runs drives")
    action.add_argument("directory")
    action.add_argument("drives", nargs="+", help=drives.NAMES)
    action = actions.add_parser("compare", help="exits 1 where anything differs")
    action.add_argument("before")
    action.add_argument("after")
    actions.add_parser("digest", help="SHA-256 of the first pairs of three recorded drives")
    actions.add_parser("count", help="numbers of src/odometry")


def main(arguments):
    if arguments.action == "record":
        return record(arguments.directory, arguments.drives)
    if arguments.action == "digest":
        return print(digest())
    return compare(arguments.before, arguments.after) if arguments.action == "compare" else count()
