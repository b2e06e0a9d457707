"""Programs of this build, and how to run them: one at a time or in a pool."""
import concurrent.futures
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Another build is measured with TOOLS=DIRECTORY, where its programs lie.
TOOLS = pathlib.Path(os.environ.get("TOOLS", ROOT / ".catkin_ws/devel/lib/stereo_descriptor_vo"))
JOBS = int(os.environ.get("JOBS", os.cpu_count()))


def program(name, tools=TOOLS):
    if not (tools / name).exists():
        sys.exit(f"error: no {name} in {tools}: run scripts/build {name} first")
    return tools / name


def run(name, *arguments, tools=TOOLS):
    """Standard output of a program of this build, which has to succeed."""
    command = [str(word) for word in (program(name, tools), *arguments)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)
    if done.returncode != 0:
        raise SystemExit(f"error: {' '.join(command)}\n{done.stderr}")
    return done.stdout


def pool(jobs=JOBS):
    return concurrent.futures.ThreadPoolExecutor(jobs)


def add_params(parser):
    parser.add_argument("--param", action="append", default=[], metavar="NAME=VALUE", help="option of the odometry, repeatable")


def params(arguments):
    """What `add_params` read, as arguments of a program."""
    return [word for setting in arguments.param for word in ("--param", setting)]
