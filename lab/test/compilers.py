#!/usr/bin/env python3
"""Compiles every source and test without making code, by another compiler or against another OpenCV; any warning is a failure.

    lab/test/compilers.py --compiler clang++-14
    lab/test/compilers.py --opencv DIR/usr/include/opencv4    # where libopencv-*-dev of another release are unpacked

The flags are those of the package (-Wall -Wextra -Wpedantic -Wshadow). Only the messages' headers are built, in a workspace of its own,
where each source stands by itself.
"""
import argparse
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WORKSPACE = ROOT / ".catkin_ws/compilers"
JOBS = int(os.environ.get("JOBS", str(os.cpu_count())))


def commands():
    """How CMake would compile each file of the package."""
    build = [ROOT / "scripts" / "build", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", "--force-cmake",
             "stereo_descriptor_vo_generate_messages_cpp"]
    environment = dict(os.environ, UNITY="OFF", WORKSPACE=str(WORKSPACE), PROGRESS="OFF")
    done = subprocess.run(build, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        sys.exit(done.stdout[-2000:] + "error: the package cannot be configured")
    entries = json.loads((WORKSPACE / "build" / "compile_commands.json").read_text())
    return {entry["file"]: entry for entry in entries if "/src/stereo_descriptor_vo/" in entry["file"]}.values()


def complaints(entry, compiler, opencv):
    """What the compiler says about a file."""
    arguments = re.sub(r"^.*?(?= -[DI])", "", entry["command"])  # without the compiler and what launches it
    arguments = re.sub(r" -o \S+", "", arguments).replace(" -c ", " -fsyntax-only ")
    if opencv:  # cvconfig.h lies in the folder of the architecture
        folders = [opencv] + [folder for folder in Path(opencv).parent.glob("*/opencv4")]
        arguments = arguments.replace("-isystem /usr/include/opencv4", " ".join(f"-isystem {folder}" for folder in folders))
    done = subprocess.run(f"{compiler} {arguments}", shell=True, cwd=entry["directory"], stderr=subprocess.PIPE, text=True)
    return done.stderr if done.returncode == 0 else done.stderr + f"{entry['file']} does not compile\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--compiler", default="c++")
    parser.add_argument("--opencv", metavar="DIR", help="OpenCV's headers, in place of the machine's")
    arguments = parser.parse_args()
    entries = list(commands())
    failed = 0
    with ThreadPoolExecutor(JOBS) as pool:
        for text in pool.map(lambda entry: complaints(entry, arguments.compiler, arguments.opencv), entries):
            failed += bool(text)
            print(text, end="", flush=True)
    print(f"{len(entries)} files, {failed} with warnings or errors")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
