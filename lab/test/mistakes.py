#!/usr/bin/env python3
"""Makes the mistakes of thought in lab/test/mistakes.yaml, one at a time, in a copy of the last commit that stays in .catkin_ws/mistakes: a gtest
must notice each. First that of the file's room is asked, then those of the other rooms. Exits 1 when one is not noticed.

    lab/test/mistakes.py                         # all of them
    lab/test/mistakes.py src/places              # those in these files or folders
    lab/test/mistakes.py --check                 # no test: does each still have its place, and each of lab/ablations.yaml?"""
import argparse
import pathlib
import subprocess
import sys
import time

import yaml

LAB = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(LAB))
from sdvo_lab import marks, programs  # noqa: E402
from sdvo_lab.build_copy import BuildCopy, replaced  # noqa: E402

LIST, ABLATIONS = LAB / "test/mistakes.yaml", LAB / "ablations.yaml"
ROOMS = ("odometry", "rig", "belief", "map", "matching", "motion", "front_end", "common", "places", "data", "check", "ros")
HANGS = 10  # times as long as without a mistake, and a test counts as failed


def check():
    entries = yaml.safe_load(LIST.read_text())
    edits = entries + [edit for ablation in yaml.safe_load(ABLATIONS.read_text()) for edit in ablation["edits"]]
    for edit in edits:
        replaced(edit, (programs.ROOT / edit["file"]).read_text())
    print(f"mistakes: {len(edits)} have their place")


def passes(copy, test, limit=None):
    try:
        return subprocess.run([copy.tools / test], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=limit).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def rows(entries, copy, missed):
    yield ["file", "mistake", "noticed by"]
    seconds = {}
    for entry in entries:
        room = next((part for part in pathlib.Path(entry["file"]).parts if part in ROOMS), ROOMS[0])
        noticed = None
        for test in (f"test_{name}" for name in sorted(ROOMS, key=lambda name: name != room)):
            if test not in seconds:
                copy.build(test)
                begin = time.monotonic()
                if not passes(copy, test):
                    raise SystemExit(f"error: {copy.tools / test} fails without a mistake")
                seconds[test] = time.monotonic() - begin
            with copy.edited([entry]):
                if not copy.builds(test):
                    noticed = "the compiler"
                elif not passes(copy, test, 5 + HANGS * seconds[test]):
                    noticed = test
            if noticed:
                break
        if noticed is None:
            missed.append(entry)
        yield [entry["file"], entry["why"], noticed or "**none**"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", help="or folders [default: all]")
    parser.add_argument("--check", action="store_true", help="only whether each has its place")
    arguments = parser.parse_args()
    if arguments.check:
        return check()
    entries = [entry for entry in yaml.safe_load(LIST.read_text())
               if not arguments.files or any(entry["file"].startswith(name) for name in arguments.files)]
    missed = []
    marks.show(rows(entries, BuildCopy("mistakes"), missed))
    print(f"{len(entries)} mistakes, {len(missed)} not noticed")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
