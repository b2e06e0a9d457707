"""Takes mechanisms of the odometry away, one at a time, and prints what then changes: rows of the fault campaign that turn bad, and
pairs that are DEGRADED though nothing is wrong. A mechanism without which nothing changes on unseen seeds can go.

    lab/run ablate                        # all of lab/ablations.yaml
    lab/run ablate --only rivals,revisit  # some of them
    lab/run ablate --drives figure_eight:kitti:614,hover:euroc:615,hand_held:d435_small:616

The copy of the last commit that is built stays in .catkin_ws/ablation. Recorded drives are among the undisturbed ones."""
import pathlib
import tempfile

import yaml

from . import drives, faults, marks, odometry, programs
from .build_copy import BuildCopy
from .fault_list import AFTER, EVERY, LAST, STANDING_FAULTS, faulty_pairs, write_sequence

LIST = programs.ROOT / "lab/ablations.yaml"
# Faults that the mechanisms are there for; images that show nothing are rejected before.
FAULTS = ("none,frozen,right_100_ms_late,duplicated,out_of_order,gap_1.5_s,gap_3_s,stamps_10_190_ms,bursts_1_ms,right_down_1_px,"
          "right_rotated_0.5_deg,gain_3,noise_30,rain,right_blur_4_px,motion_blur_31_px,jpeg_10,occluder_40,occluder_70,mover_40,"
          "mover_55,mover_70,standing,standing_frozen,standing_bursts_1_ms,standing_mover_40,standing_mover_55,standing_mover_70,"
          "standing_slow_mover_40,standing_slow_mover_55,standing_approached_40,standing_approached_70")


class Case:
    """A drive with a fault, written once."""

    def __init__(self, fault, seed, drive, work):
        self.fault, self.drive = fault, drive
        self.directory = pathlib.Path(tempfile.mkdtemp(dir=work))
        self.pairs = faulty_pairs(fault, seed, drive)
        write_sequence(self.pairs, drive, self.directory)
        for pair in self.pairs:
            pair.left = pair.right = None  # the memory of the images

    def verdict(self, tools):
        return faults.verdict_of(self.pairs, self.drive, self.directory, tools=tools)


def measure(cases, recorded, pool, tools):
    """What a build makes of all drives, as cells of the table."""
    verdicts = list(pool.map(lambda case: case.verdict(tools), cases))
    false_alarms = sum(pool.map(lambda drive: sum(state.state != "TRACKING" for state in odometry.run(drive.directory, tools=tools).states),
                                recorded))
    by_fault = {}
    for case, verdict in zip(cases, verdicts):
        by_fault.setdefault(case.fault, []).append(verdict)
    bad = [fault for fault, those in by_fault.items() if any(verdict.words() != "ok" for verdict in those)]

    def count(letter, names):
        return sum(verdict.counts[letter] for name in names for verdict in by_fault.get(name, ()))

    return [f"{max(verdict.sigmas for verdict in verdicts):.1f}", f"{max(1e3 * verdict.drift for verdict in verdicts):.0f}",
            count("D", by_fault), count("L", by_fault), count("D", ("none", "standing")) + false_alarms, ", ".join(bad) or "–"]


def options(parser):
    parser.add_argument("--only", help="names of ablations, with commas between; default: all")
    parser.add_argument("--drives", default="figure_eight:kitti:1,hover:euroc:2,hand_held:d435_small:3",
                        help="TRAJECTORY:RIG:SEED, with commas between [default: %(default)s]")
    parser.add_argument("--pairs", type=int, default=80, help=f"of each drive; every {EVERY} pairs the fault comes again")
    parser.add_argument("--faults", default=FAULTS, help="names of faults, with commas between")
    drives.add_rendered(parser)


def main(arguments):
    entries = yaml.safe_load(LIST.read_text())
    only = arguments.only.split(",") if arguments.only else [entry["name"] for entry in entries]
    marks.check_names(only, [entry["name"] for entry in entries])
    names = arguments.faults.split(",")
    copy = BuildCopy("ablation")
    copy.build("run_sequence")

    def rows():
        yield ["without", "largest error TRACKING [sigma]", "drift [mm]", "pairs DEGRADED", "LOST", "DEGRADED, undisturbed", "bad faults"]
        yield ["–", *measure(cases, recorded, pool, copy.tools)]
        for entry in entries:
            if entry["name"] in only:
                with copy.edited(entry["edits"]):
                    copy.build("run_sequence")
                    yield [f"{entry['name']}: {entry['what']}", *measure(cases, recorded, pool, copy.tools)]

    with drives.folders(arguments) as (work, folder), programs.pool() as pool:
        found = faults.render_all(arguments.drives, folder, arguments.pairs, LAST + AFTER, names)
        cases = list(pool.map(lambda of: Case(*of, work), [(name, *of) for name in names for of in found[name]]))
        recorded = [drives.recorded(kind, name) for kind in ("kitti", "karlsruhe") for name in drives.recorded_names(kind)]
        marks.show(rows())
