"""Measures what a pair costs and writes it between the marks of docs/precision.md, some ten minutes. Instructions are exact whatever else runs; CPU
times are the least of three runs in turn, on one thread. Needs scripts/build run_sequence evaluate_trajectory convert render_drive count_allocations
benchmark_kernels measure_latency; for the kernels Google Benchmark (Debian and Ubuntu: libbenchmark-dev; then scripts/build --force-cmake); for
instructions valgrind; for drives KITTI_DIR and EUROC_DIR."""
import json
import os
import pathlib
import re
import signal
import statistics
import subprocess
import sys
import tempfile

from . import drives, guises, marks, odometry, programs

KERNELS = {
    "fastCorners": "FAST corners of an image (plain: cv::FAST)",
    "cornerPeaks": "sub-pixel positions of 1100 corners (plain: cv::cornerSubPix)",
    "stereoMatch": "stereo match of 1100 corners, all of it",
    "freakInTwoViews": "FREAK of 1100 key points in two views, with the integral images",
    "patchAlignment": "alignment of 1100 patches between pairs",
}


def machine():
    def first(*command):
        return subprocess.run(command, check=True, stdout=subprocess.PIPE, universal_newlines=True).stdout.splitlines()[0]

    model = re.search(r"^model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    return [f"{model.group(1) if model else os.uname().machine}, {os.cpu_count()} processors; {first('c++', '--version')}; "
            f"load {os.getloadavg()[0]:.1f} at the start."]


def kernels():
    report = json.loads(programs.run("benchmark_kernels", "--benchmark_format=json", "--benchmark_repetitions=7",
                                     "--benchmark_min_time=0.2", "--benchmark_report_aggregates_only=true",
                                     "--benchmark_enable_random_interleaving=true"))
    median = {run["run_name"]: run["cpu_time"] * 1e-6 for run in report["benchmarks"] if run["aggregate_name"] == "median"}
    yield ["kernel, images of 1241x376", "plain [ms]", "vectors [ms]", "ratio"]
    for name, words in KERNELS.items():
        plain, vectors = median[f"{name}/0"], median[f"{name}/1"]
        yield [words, f"{plain:.2f}", f"{vectors:.2f}", f"{plain / vectors:.1f}"]


RUNS = 3


def cpu_times(chosen, *arguments):
    """CPU time of a pair on one thread, ms, of each drive: the least of some runs, in turn, as other programs of the machine make it longer."""
    runs = [[float(re.search(r"CPU ([\d.]+)", odometry.run(drive.directory, "--threads", "1", *arguments).said)[1]) for drive in chosen]
            for _ in range(RUNS)]
    return [min(times) for times in zip(*runs)]


def scenes(folder):
    """By name: a car, a drone, and rooms through which somebody carries the cameras of robots."""
    effects = {"pairs": 100, "noise": 2, "exposure": 0.3, "motion_blur": 0.01}
    recorded = {f"{drive.name}, {size}": drive for drive, size in ((drives.recorded("kitti", "06"), "1226x370"),
                                                                  (drives.recorded("euroc", "MH_01_moving", folder), "752x480"))}
    return {**recorded, "room, 848x480": drives.rendered(folder, "hand_held", "d435", 71, **effects),
            "room, 424x240": drives.rendered(folder, "hand_held", "d435_small", 71, **effects),
            "hovering, 424x240": drives.rendered(folder, "hover", "d435_small", 503, **effects)}


SIDES = ("sdvo::FeatureExtractor::extract(*", "sdvo::VisualOdometry::update(*")
FIRST, LAST = 6, 22  # pairs whose instructions are counted: the map has begun
# Functions with all that they call, summed.
STAGES = {
    "image side": ["FeatureExtractor::extract"],
    "… corners": ["FeatureDetector::detect"],
    "… the right image searched": ["StereoMatcher::match"],
    "… descriptors": ["StereoDescriptor::describe"],
    "… patches": ["PatchCutter::PatchCutter", "PatchCutter::cut"],
    "motion side": ["VisualOdometry::update"],
    "… matches, search, alignment": ["MotionSearch::find"],
    "… window": ["LocalMap::adjust"],
    "… … its covariances": ["WindowOptimizer::Solver::covariances"],
    "… rig": ["LearntRig::learn", "LearntRig::rotationHypothesis", "RightCameraDelay::learn"],
}


def callgrind(drive, sides, pairs, file, *arguments, dump=()):
    """Writes what these functions execute on the first pairs to a file, and before each call of `dump` to file.1, file.2 …"""
    subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={file}", *(f"--toggle-collect={side}" for side in sides),
                    *(f"--dump-before={function}" for function in dump), programs.program("run_sequence"), drive.directory, "--frames", str(pairs),
                    "--poses", f"{file}_poses.txt", "--threads", "1", *arguments],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def counted(drive, sides, pairs, *arguments):
    """Instructions on these sides, functions, of each of the first pairs."""
    with tempfile.TemporaryDirectory() as work:
        callgrind(drive, sides, pairs, f"{work}/part", *arguments, dump=["sdvo::OfflineRun::process(*"])
        # The first part ends before the first pair, the last one has no number.
        parts = sorted(pathlib.Path(work).glob("part.*"), key=lambda part: int(part.suffix[1:]))[1:] + [pathlib.Path(work) / "part"]
        return [int(re.search(r"^totals: (\d+)", part.read_text(), re.MULTILINE).group(1)) for part in parts]


def inclusive(drive, pairs):
    """Instructions of functions and of all that they call on the first pairs, by name; the most of those of one name."""
    found = {}
    with tempfile.TemporaryDirectory() as work:
        callgrind(drive, SIDES, pairs, f"{work}/part")
        said = subprocess.run(["callgrind_annotate", "--inclusive=yes", "--threshold=100", f"{work}/part"], check=True, stdout=subprocess.PIPE,
                              universal_newlines=True).stdout
    for number, name in re.findall(r"^ *([\d,]+) (?:\([^)]*\) +)?\S+?:sdvo::([\w:]+)\(", said, re.MULTILINE):
        found[name] = max(found.get(name, 0), int(number.replace(",", "")))
    return found


def by_stage(drive):
    """Millions of a pair."""
    until, before = inclusive(drive, LAST), inclusive(drive, FIRST)
    return {stage: 1e-6 * sum(until.get(name, 0) - before.get(name, 0) for name in names) / (LAST - FIRST) for stage, names in STAGES.items()}


def cost(folder):
    """Columns are scenes: what is in them, CPU time, and millions of instructions of a pair by stage."""
    chosen = scenes(folder)
    yield ["mean over pairs", *chosen]
    timing = [odometry.run(drive.directory).timing[FIRST:] for drive in chosen.values()]
    for column in ("features", "matches", "inliers"):
        yield [column, *(f"{statistics.mean(int(row[column]) for row in rows):.0f}" for rows in timing)]
    yield ["CPU time, one thread [ms]", *(f"{ms:.1f}" for ms in cpu_times(list(chosen.values())))]
    with programs.pool() as pool:
        of_scenes = list(pool.map(by_stage, chosen.values()))
    for stage in STAGES:
        yield [f"{stage} [M]", *(f"{of[stage]:.1f}" for of in of_scenes)]


def errors(drive, *setting):
    """A cell."""
    mean = odometry.errors(drive.truth, odometry.run(drive.directory, *setting).poses, drive.lengths)["mean"]
    return f"{mean['translation_percent']:.2f}, {mean['rotation_deg_per_m']:.4f}"


def compared(folder):
    """Scenes on which settings are compared."""
    return {name: drive for name, drive in scenes(folder).items() if "KITTI" in name or "424x240" in name}


def corners(folder):
    """What more corners cost and bring."""
    chosen = compared(folder)
    yield ["max_features", *(cell for name in chosen for cell in (f"{name} [M]", "t [%], r [deg/m]"))]
    for number in (400, 600, 900):
        row, setting = [number], ("--param", f"detector/max_features={number}")
        for drive in chosen.values():
            row += [f"{1e-6 * statistics.mean(counted(drive, SIDES, LAST, *setting)[FIRST:]):.1f}", errors(drive, *setting)]
        yield row


def rates(folder):
    """What fewer pairs a second, which cost less in proportion, do to the errors: t [%], r [deg/m]."""
    chosen = compared(folder)
    yield ["max_rate", *chosen]
    for words, guise in (("all pairs", "as_recorded"), ("half", "every_2nd"), ("a third", "every_3rd")):
        row = [words]
        for drive in chosen.values():
            with tempfile.TemporaryDirectory() as work:
                thinned = pathlib.Path(work) / guise
                guises.write_guise(drive, guise, thinned)
                row.append(errors(drives.Drive(drive.name, thinned, thinned / "poses.txt", drive.lengths)))
        yield row


def allocations(_):
    yield ["KITTI", "image side", "… kept", "motion side", "… kept"]
    for name in ("06", "01"):
        yield [name, *programs.run("count_allocations", drives.recorded("kitti", name).directory).split()]


def latency(_):
    """Both nodelets in one process with the camera, as they would be in its manager."""
    yield ["Hz", "pairs", "poses", "dropped", "core, median [ms]", "stamp → odom [ms]", "over the core, median [ms]", "… p95 [ms]"]
    setup, port = programs.ROOT / ".catkin_ws/devel/setup.sh", 11399
    command, sequence = programs.program("measure_latency"), drives.recorded("kitti", "06").directory
    with tempfile.TemporaryDirectory() as home:
        environment = dict(os.environ, ROS_MASTER_URI=f"http://localhost:{port}", ROS_HOME=home)
        master = subprocess.Popen(["roscore", "-p", str(port)], env=environment, stdout=subprocess.DEVNULL)
        try:
            for rate in (10, 30, 60):
                printed = subprocess.run(["bash", "-c", f". {setup}; exec {command} {sequence} {rate} 10"], check=True, env=environment,
                                         stdout=subprocess.PIPE, universal_newlines=True).stdout
                yield printed.splitlines()[-1].split()
        finally:
            master.send_signal(signal.SIGINT)
            master.wait()


TABLES = {"cost": cost, "corners": corners, "rates": rates, "allocations": allocations, "latency": latency}

PRINTED_ALONE = ("kernels", "allocations")  # no page has them


def options(parser):
    parser.add_argument("tables", nargs="*", metavar="|".join(["machine", "kernels", *TABLES]), help="[default: all]")
    drives.add_rendered(parser)
    marks.add_write(parser, marks.PERFORMANCE)


def main(arguments):
    known = ["machine", "kernels", *(TABLES if drives.data_set("kitti") else ())]
    marks.check_names(arguments.tables, known)
    with drives.folders(arguments) as (_, folder):
        for name in arguments.tables or known:
            if name == "machine":
                print("\n".join(machine()))
                if arguments.write:
                    marks.put(arguments.write, name, machine())
            else:
                page = arguments.write if name not in PRINTED_ALONE else None
                marks.show(kernels() if name == "kernels" else TABLES[name](folder), page, name)
