"""Puts every fault that images and stamps can have into rendered drives, whose truth is exact, and asks of the odometry what it then
said: its states, when it was lost and back, and whether its covariance held the error. Exits 1 when a fault made it lie (see
`judge`) or never come back. Another build's run_sequence: TOOLS=DIRECTORY.

    lab/run faults                                    # all faults, three drives
    lab/run faults --faults frozen,gap_1.5_s          # some of them
    lab/run faults --drives city_loop:kitti:4,hover:euroc:5 --pairs 1200  # other drives, two minutes each
    lab/run faults --write                            # puts the table between the marks of lab/docs/faults.md"""
import dataclasses
import pathlib
import tempfile

import numpy

from . import drives, marks, odometry, poses, programs
from .fault_list import (AFTER, EVERY, FAULTS, FIRST, LAST, LASTING_FAULTS, LENGTHENING_FAULTS, PERIOD, RENDERED, STANDING_FAULTS,
                         faulty_pairs, is_hit, parts, write_sequence)

SIGMAS = 5.0  # standard deviations that no error may exceed


def render(folder, trajectory, rig, seed, pairs, **options):
    """The same drive in another world with each seed, from one of forty places on: the way there is computed pair by pair."""
    start = 0 if trajectory in ("still", "hand_held", "turn_in_place") else 60 * ((seed - 1) % 40)
    return drives.rendered(folder, trajectory, rig, seed, start, pairs, rate=1 / PERIOD, moving_share=0.01, **options)


def render_all(text, folder, pairs, standing_pairs, faults):
    """For each fault the seeds and drives of --drives, of a standing camera where that is the fault's."""
    found = {name: [] for name in faults}
    for word in text.split(","):
        fields = word.split(":")
        if len(fields) != 3 or not fields[2].isdigit():
            raise SystemExit("error: --drives are TRAJECTORY:RIG:SEED, with commas between")
        (trajectory, rig), seed = fields[:2], int(fields[2])
        for name in faults:
            path, count = ("still", standing_pairs) if name in STANDING_FAULTS else (trajectory, pairs)
            if name in LENGTHENING_FAULTS:
                count = min(count, EVERY)
            found[name].append((seed, render(folder, path, rig, seed, count, **RENDERED.get(name, {}))))
    return found


@dataclasses.dataclass
class Step:
    """What was said of a pair, and how wrong its motion since the pair before was."""
    state: str
    stamp: float
    reason: str
    moved: bool
    error: float = 0.0      # m
    angle: float = 0.0      # deg
    sigmas: float = 0.0     # the larger of the errors of translation and of rotation, in standard deviations
    is_wrong: bool = False  # an error beyond SIGMAS that matters, too
    nees: float = numpy.nan


def steps_of(states, estimate, pairs, drive):
    """Steps of a run, with the errors of their motions."""
    steps, last = [], 0  # pair with a pose, at which the next motion begins
    for i, state in enumerate(states):
        step = Step(state.state, pairs[i].stamp, state.reason, state.moved)
        if step.moved:
            true = poses.relative(drive.poses[pairs[last].truth], drive.poses[pairs[i].truth])
            xi = poses.logarithm(poses.relative(poses.relative(estimate[last], estimate[i]), true))
            step.error, step.angle = numpy.linalg.norm(xi[:3]), numpy.degrees(numpy.linalg.norm(xi[3:]))
            sigmas = poses.sigmas(xi, state.motion)
            step.sigmas = max(sigmas)
            motion = poses.logarithm(true)
            matters = (step.error > 0.01 + 0.03 * numpy.linalg.norm(motion[:3]),
                       step.angle > 0.1 + 0.03 * numpy.degrees(numpy.linalg.norm(motion[3:])))
            step.is_wrong = any(part > SIGMAS and matter for part, matter in zip(sigmas, matters))
            step.nees = poses.square(xi, state.motion)
        steps.append(step)
        if state.has_pose:
            last = i
    return steps


@dataclasses.dataclass
class Verdict:
    counts: dict           # pairs of each state, by its first letter
    lost_after: float      # longest of all times that the fault came, s since it began; NaN: never lost
    back_after: float      # the same, s since it ended; infinite: not before it came again; NaN: it does not end
    error: float           # largest of a pair's motion while TRACKING, m
    angle: float           # the same, deg
    sigmas: float          # the same in standard deviations
    degraded_sigmas: float
    beyond: int            # pairs TRACKING beyond SIGMAS by errors too small to matter
    lies: int              # pairs TRACKING whose errors are beyond SIGMAS and matter
    degraded_lies: int
    drift: float           # largest error of position since TRACKING began, beyond 3 % of the way, m
    nees: float            # mean while TRACKING; 6 expected
    reasons: list

    def words(self):
        said = [word for word, is_so in (("LIES", self.lies or self.drift > 0.1), ("LIES WHILE DEGRADED", self.degraded_lies),
                                         ("NEVER BACK", numpy.isinf(self.back_after))) if is_so]
        return ", ".join(said) or "ok"


def largest_drift(steps, estimate, pairs, drive):
    drift, start, way = 0.0, None, 0.0
    for i, step in enumerate(steps):
        if step.state != "TRACKING":
            start = None
            continue
        if start is None:
            start, way = i, 0.0
            continue
        first, before, now = (drive.poses[pairs[k].truth] for k in (start, i - 1, i))
        way += numpy.linalg.norm(now[:3, 3] - before[:3, 3])
        error = poses.relative(poses.relative(estimate[start], estimate[i]), poses.relative(first, now))
        drift = max(drift, numpy.linalg.norm(error[:3, 3]) - 0.03 * way)
    return drift


def judge(steps, estimate, pairs, drive):
    """A motion is a lie where its error exceeds 5 standard deviations and also matters: more than 10 mm + 3 % of the
    distance, or more than 0.1 degrees + 3 % of the turn. So is, while TRACKING, a position that is off by more than
    0.1 m + 3 % of the distance since tracking began."""
    hits = [part for part in parts(list(drive.stamps)) if is_hit(part)]
    tracking, degraded = ([step for step in steps if step.state == state and step.moved] for state in ("TRACKING", "DEGRADED"))
    lost_after, back_after = [], []
    ends = [part[-1] for part in hits[:-1]] + [steps[-1].stamp]  # a fault may lengthen the drive
    for part, end in zip(hits, ends):
        began, ended, over = part[FIRST] - 1e-6, part[LAST] - 1e-6, end + 1e-6
        lost_after += [s.stamp - began for s in steps if s.state == "LOST" and began <= s.stamp < over][:1]
        back_after += ([max(s.stamp - ended, 0.0) for s in steps if s.state == "TRACKING" and ended <= s.stamp < over] +
                       [numpy.inf])[:1]

    def largest(some, name):
        return max((getattr(step, name) for step in some), default=0.0)

    return Verdict(
        {letter: sum(step.state.startswith(letter) for step in steps) for letter in "TDL"},
        max(lost_after, default=numpy.nan), max(back_after), largest(tracking, "error"), largest(tracking, "angle"),
        largest(tracking, "sigmas"), largest(degraded, "sigmas"),
        sum(step.sigmas > SIGMAS and not step.is_wrong for step in tracking), sum(step.is_wrong for step in tracking),
        sum(step.is_wrong for step in degraded), largest_drift(steps, estimate, pairs, drive),
        float(numpy.mean([step.nees for step in tracking])) if tracking else numpy.nan,
        list(dict.fromkeys(s.reason for s in steps if s.reason and s.stamp >= hits[0][FIRST] - 1e-6)))


def verdict_of(pairs, drive, directory, extra=(), tools=programs.TOOLS):
    """On a sequence that was written."""
    run = odometry.run(directory, *extra, tools=tools)
    return judge(steps_of(run.states, run.poses, pairs, drive), run.poses, pairs, drive)


def try_fault(name, seed, drive, work, extra):
    with tempfile.TemporaryDirectory(dir=work) as directory:
        pairs = faulty_pairs(name, seed, drive)
        write_sequence(pairs, drive, pathlib.Path(directory))
        verdict = verdict_of(pairs, drive, directory, extra)
    return dataclasses.replace(verdict, back_after=numpy.nan) if name in LASTING_FAULTS else verdict


HEAD = ["fault", "TRACKING/DEGRADED/LOST", "lost after [s]", "back after [s]", "error [sigma]", "[mm]",
        "[deg]", "pairs beyond 5 sigma", "[sigma] degraded", "drift [mm]", "NEES", "verdict"]
OF_THE_PAGE = 5  # columns


def row_of(name, verdicts):
    """The worst of all seeds."""
    def largest(field):
        return numpy.nanmax([getattr(verdict, field) for verdict in verdicts] + [-numpy.inf])

    lost, back = largest("lost_after"), largest("back_after")
    lost, back = ("–" if time < 0 else "never" if numpy.isinf(time) else f"{time:.1f}" for time in (lost, back))
    words = sorted({verdict.words() for verdict in verdicts} - {"ok"})
    return [name, "/".join(str(sum(verdict.counts[letter] for verdict in verdicts)) for letter in verdicts[0].counts),
            lost, back, f"{largest('sigmas'):.1f}", f"{1e3 * largest('error'):.0f}", f"{largest('angle'):.2f}",
            f"{sum(v.beyond for v in verdicts)}", f"{largest('degraded_sigmas'):.1f}", f"{1e3 * largest('drift'):.0f}",
            f"{numpy.nanmean([v.nees for v in verdicts]):.1f}", ", ".join(words) or "ok"]


def options(parser):
    parser.add_argument("--faults", help="names of faults, with commas between; default: all")
    parser.add_argument("--drives", default=",".join(f"figure_eight:kitti:{seed}" for seed in (1, 2, 3)),
                        help="TRAJECTORY:RIG:SEED, with commas between; a camera with the same rig and seed stands for the faults of "
                        "standing cameras")
    parser.add_argument("--pairs", type=int, default=75, help=f"of each drive; every {EVERY} pairs the fault comes again")
    parser.add_argument("--standing-pairs", type=int, default=60, help="the same of a standing camera")
    parser.add_argument("--reasons", action="store_true", help="also prints what the odometry said")
    programs.add_params(parser)
    drives.add_rendered(parser)
    marks.add_write(parser, marks.FAULTS)


def main(arguments):
    names = arguments.faults.split(",") if arguments.faults else [*FAULTS, *STANDING_FAULTS]
    marks.check_names(names, [*FAULTS, *STANDING_FAULTS])
    if min(arguments.pairs, arguments.standing_pairs) < LAST + AFTER:
        raise SystemExit(f"error: a drive needs {LAST + AFTER} pairs at least")
    bad, of_the_page = [], [HEAD[:OF_THE_PAGE]]

    def rows():
        yield HEAD
        for name in names:
            verdicts = [result.result() for result in tries[name]]
            row = row_of(name, verdicts)
            yield row
            of_the_page.append(row[:OF_THE_PAGE])
            if row[-1] != "ok":
                bad.append(name)
            if arguments.reasons:
                for reason in dict.fromkeys(reason for verdict in verdicts for reason in verdict.reasons):
                    print("    " + reason)

    with drives.folders(arguments) as (work, folder), programs.pool() as pool:
        found = render_all(arguments.drives, folder, arguments.pairs, arguments.standing_pairs, names)
        tries = {name: [pool.submit(try_fault, name, seed, drive, work, programs.params(arguments))
                        for seed, drive in found[name]] for name in names}
        marks.show(rows())
    if arguments.write:
        marks.put(arguments.write, "faults", marks.lines(of_the_page))
    print(f"{len(names)} faults, {len(bad)} bad" + (": " + ", ".join(bad) if bad else ""))
    return 1 if bad and not arguments.write else 0  # the page names them
