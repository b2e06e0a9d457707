"""Measures the time of the kernels, of whole drives and of the nodelets, and writes it between the marks of docs/precision.md, some
five minutes on a machine that has nothing else to do. Instructions are counted, whatever else runs. Needs scripts/build run_sequence
evaluate_trajectory count_allocations benchmark_kernels measure_latency convert render_drive; for the kernels Google Benchmark (Debian
and Ubuntu: libbenchmark-dev; then scripts/build --force-cmake); for instructions valgrind; for drives KITTI_DIR and EUROC_DIR."""
import json
import os
import pathlib
import re
import signal
import statistics
import subprocess
import sys
import tempfile

from . import drives, marks, odometry, programs

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
    commit = first("git", "-C", str(programs.ROOT), "rev-parse", "--short", "HEAD")
    return [f"{model.group(1) if model else os.uname().machine}, {os.cpu_count()} processors; {first('c++', '--version')}; "
            f"commit {commit}; load {os.getloadavg()[0]:.1f} at the start."]


def kernels():
    report = json.loads(programs.run("benchmark_kernels", "--benchmark_format=json", "--benchmark_repetitions=7",
                                     "--benchmark_min_time=0.2", "--benchmark_report_aggregates_only=true",
                                     "--benchmark_enable_random_interleaving=true"))
    median = {run["run_name"]: run["cpu_time"] * 1e-6 for run in report["benchmarks"] if run["aggregate_name"] == "median"}
    yield ["kernel, images of 1241x376", "plain [ms]", "vectors [ms]", "ratio"]
    for name, words in KERNELS.items():
        plain, vectors = median[f"{name}/0"], median[f"{name}/1"]
        yield [words, f"{plain:.2f}", f"{vectors:.2f}", f"{plain / vectors:.1f}"]


def timed(drive, *arguments, runs=3):
    """Medians over some runs of CPU, median and 95th percentile of the wall time (ms a pair), and the last run."""
    all_runs = [odometry.run(drive.directory, *arguments) for _ in range(runs)]
    times = [[float(x) for x in re.search(r"median ([\d.]+) ms, p95 ([\d.]+) ms, CPU ([\d.]+)", run.said).groups()] for run in all_runs]
    wall, p95, cpu = (statistics.median(column) for column in zip(*times))
    return (cpu, wall, p95), all_runs[-1]


def cells(times):
    return [f"{time:.1f}" for time in times]


def drive_table(folder):
    yield ["drive", "threads", "CPU [ms a pair]", "wall, median", "wall, p95"]
    names = [("kitti", "06"), ("kitti", "01"), *(("euroc", name) for name in drives.recorded_names("euroc"))]
    for drive in (drives.recorded(kind, name, folder) for kind, name in names):
        for threads in (1, 2):
            yield [drive.name, threads, *cells(timed(drive, "--threads", threads)[0])]


def in_a_room(folder):
    """Somebody walks through a room with the cameras that robots carry."""
    return {f"hand_held, {rig}, {size}": drives.rendered(folder, "hand_held", rig, 1, pairs=100, noise=2, exposure=0.3, motion_blur=0.01)
            for rig, size in (("d435_small", "424x240"), ("oak_d", "640x400"))}


def small_images(folder):
    yield ["drive", "CPU [ms a pair]", "wall, median", "wall, p95", "CPU, KITTI 06 = 1", "p95 by median"]
    chosen = {"KITTI 06, 1226x370": drives.recorded("kitti", "06"), **in_a_room(folder)}
    whole = None
    for name, drive in chosen.items():
        (cpu, wall, p95), _ = timed(drive)
        whole = whole or cpu
        yield [name, *cells((cpu, wall, p95)), f"{cpu / whole:.2f}", f"{p95 / wall:.2f}"]


SIDES = ("sdvo::FeatureExtractor::extract(*", "sdvo::VisualOdometry::update(*")


def counted(drive, sides, pairs, *arguments):
    """Instructions on these sides, functions, of each of the first pairs."""
    with tempfile.TemporaryDirectory() as work:
        subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={work}/part", *(f"--toggle-collect={side}" for side in sides),
                        "--dump-before=sdvo::OfflineRun::process(*", programs.program("run_sequence"), drive.directory, "--frames", str(pairs),
                        "--poses", f"{work}/poses.txt", "--threads", "1", *arguments],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        # The first part ends before the first pair, the last one has no number.
        parts = sorted(pathlib.Path(work).glob("part.*"), key=lambda part: int(part.suffix[1:]))[1:] + [pathlib.Path(work) / "part"]
        return [int(re.search(r"^totals: (\d+)", part.read_text(), re.MULTILINE).group(1)) for part in parts]


def stored(name):
    """The figures that the page has of this table, by the first cell of their rows."""
    rows = re.search(rf"<!-- {name} -->\n(.*?)<!-- end -->", marks.PERFORMANCE.read_text(), re.DOTALL).group(1).splitlines()[2:]
    return {cells[0]: cells for cells in ([cell.strip() for cell in row.strip("| ").split("|")] for row in rows)}


def instructions(folder):
    """Millions of a pair, and their ratio to what the page had before."""
    yield ["drive", "image side", "motion side", "a pair", "p95 by median", "by the figure before"]
    before = stored("instructions")
    chosen = {"KITTI 06": drives.recorded("kitti", "06"), "EuRoC MH_01_half": drives.recorded("euroc", "MH_01_half", folder), **in_a_room(folder)}
    for name, drive in chosen.items():
        counts = [counted(drive, [side], 30)[2:] for side in SIDES]
        sides = [statistics.mean(side) * 1e-6 for side in counts]
        whole = sorted(map(sum, zip(*counts)))
        ratio = sum(sides) / float(before[name][3]) if name in before else 1.0
        yield [name, *(f"{million:.1f}" for million in (*sides, sum(sides))), f"{whole[int(0.95 * len(whole))] / statistics.median(whole):.2f}",
               f"{ratio:.2f}"]


def guard(rows):
    """Fails where a drive takes more than 5 % more instructions than the page has."""
    grown = [line for line in rows[2:] if float(line.strip("| ").split("|")[-1]) > 1.05]
    if grown:
        sys.exit("error: more instructions than before\n" + "\n".join(grown))


def growth(folder):
    yield ["corners", *(cell for name in ("KITTI 06", "MH_01_half") for cell in (f"{name} [millions]", "t [%]", "r [deg/m]"))]
    chosen = [drives.recorded("kitti", "06"), drives.recorded("euroc", "MH_01_half", folder)]
    for count in (300, 450, 600, 1100):
        row, setting = [count], ["--param", f"detector/max_features={count}"]
        for drive in chosen:
            mean = odometry.errors(drive.truth, odometry.run(drive.directory, *setting).poses, drive.lengths)["mean"]
            millions = statistics.mean(counted(drive, SIDES, 30, *setting)[2:]) * 1e-6
            row += [f"{millions:.1f}", f"{mean['translation_percent']:.3f}", f"{mean['rotation_deg_per_m']:.4f}"]
        yield row


def allocations(_):
    yield ["KITTI", "image side", "… kept", "motion side", "… kept"]
    for name in ("06", "01"):
        yield [name, *programs.run("count_allocations", drives.recorded("kitti", name).directory).split()]


def latency(_):
    """Both nodelets in one process with the camera, as they would be in its manager."""
    yield ["Hz", "pairs", "poses", "dropped", "core, median [ms]", "stamp → odom", "over the core", "… p95"]
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


TABLES = {"instructions": instructions, "drives": drive_table, "small_images": small_images, "growth": growth, "allocations": allocations, "latency": latency}

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
                rows = marks.show(kernels() if name == "kernels" else TABLES[name](folder), page, name)
                if name == "instructions" and not arguments.write:
                    guard(rows)
