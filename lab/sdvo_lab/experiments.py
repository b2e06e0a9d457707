"""The paper's experiments: runs run_experiments, writes rows by drive beside its CSV files, draws the figures and prints the tables.

    lab/run experiments all --output out                    # everything in lab/docs/experiments.md; some ten minutes
    lab/run experiments all --output out --only robustness  # one of matching, ablation, robustness, sift, scale_change, consensus, accuracy
    lab/run experiments matching --output out ARGUMENT …    # one run of run_experiments, with its arguments
    lab/run experiments size_curve --output out ARGUMENT …  # one run of learn size-curve, with its arguments

`all` takes the drives of KITTI_DIR, and those of KARLSRUHE_DIR and EUROC_DIR where they are set; it renders the drives that out/drives
lacks. Results do not depend on JOBS, the number of programs that run at a time."""
import pathlib
import sys

from . import drives, programs, results

PASSES_ON = True  # what it does not know are arguments of the programs
NAMES = ("matching", "ablation", "robustness", "sift", "scale_change", "consensus", "accuracy")
SETUPS = ("product", "paper")
# Rendered drives: name, trajectory (one of KITTI's or a preset), first pose, seed, rig, rate. None of them, nor its seed, served to
# choose an option.
STREETS = [("d00", "00", 100, 11), ("d01", "01", 400, 18), ("d02", "02", 500, 12), ("d03", "03", 200, 13), ("d05", "05", 300, 14),
           ("d08", "08", 400, 15), ("d09", "09", 200, 16), ("d10", "10", 100, 17)]
SMALL_RIGS = [("s1", "hand_held", 0, 71, "d435_small"), ("s2", "corridor", 0, 72, "oak_d"), ("s3", "desk", 0, 73, "d435"),
              ("s4", "hand_held", 0, 74, "zed_mini")]
# With long steps, whose scale changes are large: a street, and a corridor with walls at its turns.
APPROACHES = [("a1", "straight", 0, 81, "kitti", 10), ("a2", "corridor", 0, 82, "oak_d", 4), ("a3", "corridor", 0, 83, "d435_small", 4)]


def render(folder, name, trajectory, start, seed, rig="kitti", rate=None):
    options = {"noise": 2, "exposure": 0.3, "threads": 1}
    if trajectory.isdigit():
        trajectory = drives.data_set("kitti") / "poses" / f"{trajectory}.txt"
        options["moving_share"] = 0.02
    if rate:
        options["rate"] = rate
    return drives.rendered(folder, trajectory, rig, seed, start, 31, name=name, **options).directory


class Plan:
    """Runs of run_experiments: folder below the output, experiment and arguments."""

    def __init__(self, output, pool):
        folder = output / "drives"
        euroc = [drives.recorded("euroc", name, folder).directory for name in ("MH_01_half", "MH_01_moving") if drives.data_set("euroc")]
        karlsruhe = [drives.recorded("karlsruhe", "19").directory] if drives.data_set("karlsruhe") else []
        rendered = dict(zip((drive[0] for drive in STREETS + SMALL_RIGS + APPROACHES),
                            pool.map(lambda drive: render(folder, *drive), STREETS + SMALL_RIGS + APPROACHES)))
        usual = [rendered[drive[0]] for drive in STREETS + SMALL_RIGS]
        self.every = ["01", "04", "06", *karlsruhe, *euroc, *usual]
        # The ground truth of KITTI 01 is 0.8 % too short, that of Karlsruhe 19 has wrong lengths.
        self.with_true_lengths = ["04", "06", *euroc, *usual]
        self.approaches = ["04", "06", rendered["d00"], rendered["d05"], *(rendered[drive[0]] for drive in APPROACHES)]
        self.runs = []

    def add(self, folder, experiment, setup, sequences, frames, *arguments):
        self.runs.append((folder, experiment, ["--setup", setup, "--kitti", drives.data_set("kitti"), "--frames", frames,
                                               "--sequences", ",".join(map(str, sequences)), *arguments]))

    def add_matching(self, folder, setup, sequences, frames, descriptor, sizes, *arguments):
        self.add(folder, "matching", setup, sequences, frames, "--descriptors", descriptor, "--constant-sizes", sizes, *arguments)

    def matching(self):
        for setup in SETUPS:
            self.add_matching(setup, setup, self.every, 21, "freak", "14", "--features", "310,1350,2320")

    def sift(self):
        for setup in SETUPS:
            self.add_matching(f"{setup}/sift", setup, self.every, 11, "sift", "5", "--features", "2320", "--layouts", "left", "--tolerances", "3")

    def ablation(self):
        for line in programs.run("run_experiments", "ablations").splitlines():
            setup, change, *settings = line.split("\t")
            self.add_matching(f"ablation/{setup} {change}", setup, ["01", "04", "06"], 11, "freak", "14", "--features", "2320", "--layouts",
                              "left", *(word for setting in settings for word in ("--param", setting)))

    def robustness(self):
        for setup in SETUPS:
            self.add(setup, "robustness", setup, self.every, 11, "--stride", "5")

    def accuracy(self):
        for setup in SETUPS:
            self.add(setup, "accuracy", setup, self.with_true_lengths, 11, "--features", "400")

    def scale_change(self):
        self.add("scale_change", "scale_change", "product", self.approaches, 31)

    def consensus(self):
        self.runs.append(("consensus", "consensus", ["--seeds", "100"]))


def run(folder, experiment, arguments):
    """One experiment: its rows by drive, and a figure."""
    folder.mkdir(parents=True, exist_ok=True)
    programs.run("run_experiments", experiment, "--output", folder, *arguments)
    return results.summarise(experiment, folder)


def run_all(output, only):
    from . import diagrams, tables
    if drives.data_set("kitti") is None:
        sys.exit("error: set KITTI_DIR")
    with programs.pool() as pool:
        plan = Plan(output, pool)
        for name in [only] if only else NAMES:
            getattr(plan, name)()
        done = [pool.submit(run, output / folder, experiment, arguments) for folder, experiment, arguments in plan.runs]
        for (folder, experiment, _), rows in zip(plan.runs, done):
            print(f"{folder}: {experiment}, {len(rows.result())} rows", flush=True)
            if experiment in diagrams.FIGURES and "ablation" not in folder:
                diagrams.FIGURES[experiment](output / folder, rows.result())
    lines = [f"{name}\n\n" + "\n".join(table) + "\n" for name, table in tables.tables_of(output).items()]
    (output / "tables.md").write_text("\n".join(lines))
    print("\n".join(lines))


def options(parser):
    parser.add_argument("experiment", choices=["all", "matching", "robustness", "accuracy", "consensus", "scale_change", "size_curve"])
    parser.add_argument("--output", type=pathlib.Path, required=True, help="folder to write to; made where it is missing")
    parser.add_argument("--only", choices=NAMES, help="one experiment of all")


def main(arguments):
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    if arguments.experiment == "all":
        return run_all(output, arguments.only)
    from . import diagrams
    if arguments.experiment == "size_curve":
        samples, curve = output / "size_curve.csv", output / "size_curve.yaml"
        print(programs.run("learn", "size-curve", "--output", curve, "--samples", samples, *arguments.rest))
        return diagrams.draw_depth_scale(samples, curve, output / "size_curve.png")
    rows = run(output, arguments.experiment, arguments.rest)
    print(rows.to_string(index=False))
    if arguments.experiment in diagrams.FIGURES:
        diagrams.FIGURES[arguments.experiment](output, rows)
