"""Blinds a drive for some pairs, or carries the camera elsewhere meanwhile: does the odometry find its map again, and only there?

    lab/run outages hover:d435:511 hover:d435:512 --black 5,20 --at 60     # black pairs at a pair
    lab/run outages kitti:03 euroc:MH_01_half --black 3,10 --places 5      # ... at so many places of each drive
    lab/run outages euroc:MH_01_still --repeated 15 --black 30             # a camera that stands: its first pairs to and fro
    lab/run outages hover:d435_small:1101:0:1200 --every 100               # every 100th pair black
    lab/run outages kitti:04 kitti:06 --elsewhere 200                      # excerpts joined by black pairs, so many times

The pose after an outage is compared with that of the same pair in the undisturbed run, in standard deviations of its motion since
the last pose. Exits 1 where it is off by more than 5, where no map was found though a third of the points was in view, or where
another place was taken for the map. Another build's run_sequence: TOOLS=DIRECTORY."""
import dataclasses
import itertools
import pathlib
import shutil
import tempfile

import cv2
import numpy

from . import drives, marks, odometry, poses, programs

SIGMAS = 5.0       # standard deviations that no error may exceed
IN_VIEW = 1 / 3    # share of the points from which on an outage has to cost nothing
EXCERPT, GAP = 8, 3  # pairs of a place, and black ones between two
# Error of a motion between views of one place: m, ratio of the distance, rad (chosen: other places are farther off).
SAME_DISTANCE, SAME_RATIO, SAME_ANGLE = 0.1, 0.1, 0.1
BLACK = 2          # grey level of a covered lens


def options(parser):
    parser.add_argument("drives", nargs="+", help=drives.NAMES)
    parser.add_argument("--black", default="3,10", help="lengths of outages, pairs [default: %(default)s]")
    parser.add_argument("--at", help="pairs at which they begin [default: --places of them, evenly]")
    parser.add_argument("--places", type=int, default=5, help="outages of each length in a drive [default: %(default)s]")
    parser.add_argument("--every", type=int, metavar="PAIRS", help="blackens every so many's last one instead")
    parser.add_argument("--repeated", type=int, help="the drive is its first so many pairs, to and fro, six times")
    parser.add_argument("--elsewhere", type=int, metavar="TRIALS", help="joins excerpts instead")
    parser.add_argument("--seed", type=int, default=1, help="of the excerpts [default: %(default)s]")
    programs.add_params(parser)
    drives.add_rendered(parser)


class Sequence:
    """A drive in the making, in the camera and at the rate of another one."""

    def __init__(self, folder, drive):
        self.folder, self.drive, self.count = folder, drive, 0
        self.period = numpy.median(numpy.diff(drive.stamps))
        self.shape = drives.pixels(drive.path(0, 0)).shape
        for side in (0, 1):
            (folder / f"image_{side}").mkdir(parents=True)
        shutil.copy(drive.directory / "calib.txt", folder)

    def add(self, *pair):
        """Left and right: a path, which is linked, an image, or a grey level. Other images are cut or enlarged."""
        for side, image in enumerate(pair):
            path = self.folder / f"image_{side}" / f"{self.count:06d}.png"
            if isinstance(image, pathlib.Path):
                path.symlink_to(image)
                continue
            if isinstance(image, int):
                image = numpy.full(self.shape, image, numpy.uint8)
            (h, w), (rows, columns) = self.shape, image.shape
            image = cv2.copyMakeBorder(image[:h, :w], 0, max(h - rows, 0), 0, max(w - columns, 0), cv2.BORDER_REFLECT)
            cv2.imwrite(str(path), image, [cv2.IMWRITE_PNG_COMPRESSION, 0])
        self.count += 1

    def run(self, arguments):
        (self.folder / "times.txt").write_text("".join(f"{i * self.period:.9f}\n" for i in range(self.count)))
        return odometry.run(self.folder, *programs.params(arguments))


def pair_of(drive, i):
    return [drive.path(side, i).resolve() for side in (0, 1)]


# --- Black pairs -------------------------------------------------------------------------------------------------------

def numbers_of(drive, repeated):
    """The drive's pairs in the order in which they are shown."""
    if not repeated:
        return list(range(len(drive.stamps)))
    there = list(range(repeated))
    return 3 * (there + there[::-1])


def with_black(drive, numbers, black, folder):
    sequence = Sequence(folder, drive)
    for k, i in enumerate(numbers):
        sequence.add(*([BLACK, BLACK] if k in black else pair_of(drive, i)))
    return sequence


def share_in_view(drive, before, after, T_before_after):
    """Of the points of a pair those that another one could see."""
    left, right = (drives.pixels(drive.path(side, before)) for side in (0, 1))
    f, cx, cy, baseline = drive.camera
    corners = cv2.goodFeaturesToTrack(left, 1000, 0.01, 5).reshape(-1, 2)
    disparities = cv2.StereoSGBM_create(0, 128, 7, P1=400, P2=1600, uniquenessRatio=10).compute(left, right) / 16.0
    points = [((u - cx) * baseline / d, (v - cy) * baseline / d, f * baseline / d)
              for u, v in corners for d in [disparities[int(v), int(u)]] if d > 0.5]
    x, y, z = numpy.linalg.inv(T_before_after)[:3] @ numpy.vstack([numpy.transpose(points), numpy.ones(len(points))])
    ahead = z > 0.1
    u, v = f * x[ahead] / z[ahead] + cx, f * y[ahead] / z[ahead] + cy
    rows, columns = left.shape
    return numpy.sum((u >= 0) & (u < columns) & (v >= 0) & (v < rows)) / max(len(points), 1)


@dataclasses.dataclass
class Outage:
    name: str
    first: int
    black: int
    in_view: float  # share of the points
    lost: int       # pairs
    restarts: int
    reason: str     # of the first pose after it
    offset: float   # of that pose to the undisturbed one, m
    sigmas: float
    error: float    # of the whole drive, % of the distance; NaN without ground truth
    undisturbed_error: float

    @property
    def is_wrong(self):
        return self.sigmas > SIGMAS if self.restarts == 0 else self.in_view >= IN_VIEW

    def row(self):
        return [self.name, self.first, self.black, f"{self.in_view:.2f}", self.lost, self.restarts, f"{1e3 * self.offset:.1f}",
                f"{self.sigmas:.1f}", f"{self.error:.3f}", f"{self.undisturbed_error:.3f}", f"{'WRONG ' if self.is_wrong else ''}{self.reason}"]


HEAD = ["drive", "first", "black", "in view", "LOST", "restarts", "offset [mm]", "sigma", "error [%]", "undisturbed", "first pose after it"]


def summary(outages):
    """A row for each drive and length."""
    yield ["drive", "black pairs", "outages", "a third in view", "of these found", "restarts", "largest offset [sigma]", "error [%]", "undisturbed [%]"]
    for name, black in dict.fromkeys((outage.name, outage.black) for outage in outages):
        some = [outage for outage in outages if (outage.name, outage.black) == (name, black)]
        seen = [outage for outage in some if outage.in_view >= IN_VIEW]
        yield [name, black, len(some), len(seen), sum(outage.restarts == 0 for outage in seen), sum(outage.restarts for outage in some),
               f"{max((outage.sigmas for outage in some if outage.restarts == 0), default=numpy.nan):.1f}",
               *(f"{numpy.mean([getattr(outage, error) for outage in some]):.3f}" for error in ("error", "undisturbed_error"))]


def drift(estimate, truth):
    """Root mean square of the positions' error, % of the distance."""
    truth = numpy.array([poses.relative(truth[0], pose)[:3, 3] for pose in truth])
    distance = numpy.linalg.norm(numpy.diff(truth, axis=0), axis=1).sum()
    return 100 * numpy.sqrt(numpy.mean(numpy.sum((estimate[:, :3, 3] - truth) ** 2, axis=1))) / max(distance, 1e-9)


def offset(run, undisturbed, black):
    """The first pair after an outage that has a pose; how far that is from the undisturbed run's, which began alike, m and sigma."""
    before = black[0] - 1
    after = next((k for k in range(black.stop, len(run.states)) if run.states[k].has_pose), len(run.states) - 1)
    xi = poses.logarithm(poses.relative(*(poses.relative(some.poses[before], some.poses[after]) for some in (undisturbed, run))))
    C = run.states[after].motion
    return after, numpy.linalg.norm(xi[:3]), max(poses.sigmas(xi, C)) if C.any() else numpy.nan


def outage(drive, numbers, blacks, undisturbed, folder, arguments):
    """Of one drive, or several as its worst."""
    dark = {k for black in blacks for k in black}
    run = with_black(drive, numbers, dark, folder).run(arguments)
    after, distance, sigmas = zip(*(offset(run, undisturbed, black) for black in blacks))
    worst = int(numpy.argmax(sigmas))
    truth = drive.poses[numbers] if drive.truth.exists() else None
    shown = [k for k in range(len(numbers)) if k not in dark]
    errors = [drift(estimate[shown], truth[shown]) if truth is not None else numpy.nan for estimate in (run.poses, undisturbed.poses)]
    first, a = blacks[worst][0], after[worst]
    return Outage(drive.name, first, len(dark),
                  share_in_view(drive, numbers[first - 1], numbers[a], poses.relative(undisturbed.poses[first - 1], undisturbed.poses[a])),
                  sum(state.state == "LOST" for state in run.states[min(dark):]), run.states[-1].epoch - undisturbed.states[-1].epoch,
                  f"{run.states[a].state}: {run.states[a].reason}", distance[worst], sigmas[worst], *errors)


def planned(count, arguments):
    """The outages of each run, as ranges of so many pairs."""
    if arguments.every:
        yield [range(k, k + 1) for k in range(arguments.every - 1, count - 1, arguments.every)]
        return
    for black in map(int, arguments.black.split(",")):
        ends = numpy.linspace(10, count - black - 5, arguments.places + 1)
        for first in map(int, arguments.at.split(",") if arguments.at else ends[:-1]):
            yield [range(first, first + black)]


def outages(all_drives, work, arguments):
    for drive in all_drives:
        numbers = numbers_of(drive, arguments.repeated)
        undisturbed = with_black(drive, numbers, (), work / "undisturbed").run(arguments)
        shutil.rmtree(work / "undisturbed")
        for blacks in planned(len(numbers), arguments):
            yield outage(drive, numbers, blacks, undisturbed, work / "black", arguments)
            shutil.rmtree(work / "black")


def measure_black(all_drives, work, arguments):
    found = []
    marks.show(itertools.chain([HEAD], (found.append(outage) or outage.row() for outage in outages(all_drives, work, arguments))))
    print()
    marks.show(summary(found))
    return sum(outage.is_wrong for outage in found)


# --- Another place -----------------------------------------------------------------------------------------------------

def swapped(pair, seen, random):
    return pair[::-1]


def mirrored(pair, seen, random):
    """The mirror image of the world: left and right change places, too."""
    return [numpy.ascontiguousarray(image[:, ::-1]) for image in pair[::-1]]


def repeated(pair, seen, random):
    """An object of the place before stands here as well, a tenth to a third of the view."""
    share = random.uniform(0.1, 0.33) ** 0.5
    rows, columns = pair[0].shape
    h, w = int(share * rows), int(share * columns)
    y, x = random.integers(rows - h + 1), random.integers(columns - w + 1)
    copies = [image.copy() for image in pair]
    for copy, image in zip(copies, seen):
        part = image[y:y + h, x:x + w]
        copy[y:y + part.shape[0], x:x + part.shape[1]] = part[:copy.shape[0] - y, :copy.shape[1] - x]
    return copies


def as_it_is(pair, seen, random):
    return pair


CHANGES = (as_it_is, repeated, mirrored, swapped)


@dataclasses.dataclass
class Place:
    drive: drives.Drive
    numbers: range  # of its pairs
    first: int      # of the sequence's
    change: object


def join(all_drives, trials, random, sequence):
    """Excerpts in a random order; most as they are, for the next one is to have a map to be found in."""
    places, seen = [], None
    for k in range(trials + 1):
        drive = all_drives[random.integers(len(all_drives))]
        start = random.integers(len(drive.stamps) - EXCERPT)
        change = CHANGES[random.integers(len(CHANGES))] if k % 2 else as_it_is
        places.append(Place(drive, range(start, start + EXCERPT), sequence.count, change))
        for i in places[-1].numbers:
            pair = [drives.pixels(drive.path(side, i)) for side in (0, 1)]
            if seen is not None:
                pair = change(pair, seen, numpy.random.default_rng(k))
            sequence.add(*pair)
        seen = pair
        for _ in range(GAP):
            sequence.add(BLACK, BLACK)
    return places


def motion_between(drive, before, after, change, T_world_camera):
    """True motion from pair `before` to pair `after` of a drive; of the right camera's mirror image in the mirrored world."""
    motion = poses.relative(T_world_camera[before], T_world_camera[after])
    if change is not mirrored:
        return motion
    T_left_right, mirror = poses.translation([drive.camera[3], 0, 0]), numpy.diag([-1, 1, 1, 1])
    return mirror @ poses.relative(T_left_right, motion @ T_left_right) @ mirror


def is_same(places, run, k, poses_of):
    """Whether the pose of the sequence's pair k is right: the last place of its epoch, which may have been a while ago, is of the
    same drive, which knows its poses. One of that place's pairs will do: an object that goes along with the camera misleads those
    after it."""
    place_of = {place.first + j: place for place in places for j in range(EXCERPT)}
    earlier = [j for j in place_of if j < k and run.states[j].has_pose and run.states[j].epoch == run.states[k].epoch]
    before, after = place_of[max(earlier, default=k)], place_of[k]
    changes = {before.change, after.change}
    if before.drive != after.drive or swapped in changes or (mirrored in changes and changes != {mirrored}):
        return False

    def is_near(j):
        pairs = before.numbers[j - before.first], after.numbers[k - after.first]
        true = motion_between(before.drive, *pairs, before.change, poses_of[before.drive])
        error = poses.logarithm(poses.relative(true, poses.relative(run.poses[j], run.poses[k])))
        is_far = numpy.linalg.norm(error[:3]) > SAME_DISTANCE + SAME_RATIO * numpy.linalg.norm(true[:3, 3])
        return not is_far and numpy.linalg.norm(error[3:]) <= SAME_ANGLE

    return any(is_near(j) for j in earlier if place_of[j] is before)


def measure_elsewhere(all_drives, work, arguments):
    sequence = Sequence(work / "joined", all_drives[0])
    places = join(all_drives, arguments.elsewhere, numpy.random.default_rng(arguments.seed), sequence)
    run = sequence.run(arguments)
    # Without ground truth the poses are those of the odometry, undisturbed.
    poses_of = {drive: drive.poses if drive.truth.exists() else odometry.run(drive.directory).poses for drive in all_drives}
    tried, right, wrong = dict.fromkeys(CHANGES, 0), 0, 0
    for before, after in zip(places, places[1:]):
        tried[after.change] += 1
        for k in range(after.first, after.first + EXCERPT):
            if "re-acquired" not in run.states[k].reason:
                continue
            same = is_same(places, run, k, poses_of)
            right, wrong = right + same, wrong + (not same)
            print(f"{'the same place' if same else 'WRONG'}: {before.drive.name} {before.numbers[-1]} -> {after.drive.name} "
                  f"{after.numbers[0]} {after.change.__name__}, pair {k}: {run.states[k].state}: {run.states[k].reason}")
    print("trials: " + ", ".join(f"{change.__name__} {count}" for change, count in tried.items()) +
          f"; taken for the map {wrong}, found in it rightly {right}")
    return wrong


def main(arguments):
    with drives.folders(arguments) as (work, folder), tempfile.TemporaryDirectory(dir=work) as scratch:
        all_drives = [drives.named(name, folder) for name in arguments.drives]
        measure = measure_elsewhere if arguments.elsewhere else measure_black
        return int(measure(all_drives, pathlib.Path(scratch), arguments) > 0)
