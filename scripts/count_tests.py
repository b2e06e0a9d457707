#!/usr/bin/env python3
"""Counts test cases in JUnit files, names the ten slowest, and ends with one line: N passed, N failed, N skipped. Exits 1 on any failure. Tests may
only be skipped for want of a data set, or of a processor's instructions: with KITTI_DIR, EUROC_DIR and KARLSRUHE_DIR all set
none other may be."""
import argparse
import os
import pathlib
import re
import sys
import xml.etree.ElementTree as ElementTree

MISSING = [name for name in ("KITTI_DIR", "EUROC_DIR", "KARLSRUHE_DIR") if not os.environ.get(name)]


def may_skip(reason):
    """Old versions of gtest give no reason."""
    return any(name in reason for name in [*MISSING, "this processor has"]) if reason else bool(MISSING)


def outcome(case):
    if case.find("failure") is not None or case.find("error") is not None:
        return "failed"
    skipped = case.find("skipped")
    if skipped is not None or case.get("result") == "skipped" or case.get("status") == "notrun":
        reason = "" if skipped is None else skipped.get("message") or skipped.text or ""
        return "skipped" if may_skip(reason) else "failed"
    return "passed"


def announced_skips(root):
    """rostest forgets tests that are skipped; ours print the reason."""
    return {reason for output in root.iter("system-out") for reason in re.findall(r"\*\*\* SKIPPED: (.*)", output.text or "")}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", type=pathlib.Path, help="folder with the JUnit files")
    parser.add_argument("--passed", action="append", default=[], help="a check beside the JUnit files that passed")
    parser.add_argument("--failed", action="append", default=[], help="a check beside the JUnit files that failed")
    parser.add_argument("--skipped", action="append", default=[], help="a check beside the JUnit files that could not be made; it said why")
    arguments = parser.parse_args()

    counts = {"passed": len(arguments.passed), "failed": len(arguments.failed), "skipped": len(arguments.skipped)}
    bad = list(arguments.failed)
    seconds = []
    for path in sorted(arguments.directory.rglob("*.xml")):
        try:
            root = ElementTree.parse(path).getroot()
        except ElementTree.ParseError as error:
            counts["failed"] += 1
            bad.append(f"{path.name}: {error}")
            continue
        for reason in announced_skips(root):
            result = "skipped" if may_skip(reason) else "failed"
            counts[result] += 1
            print(f"{result.upper()}: {reason} ({path.name})")
        for case in root.iter("testcase"):
            result = outcome(case)
            counts[result] += 1
            seconds.append((float(case.get("time") or 0), f"{case.get('classname')}.{case.get('name')}"))
            if result != "passed":
                print(f"{result.upper()}: {case.get('classname')}.{case.get('name')} ({path.name})")
    for time, name in sorted(seconds, reverse=True)[:10]:
        print(f"{time:.1f} s: {name}")
    if sum(counts.values()) == 0:
        bad.append("no test ran")
    for name in arguments.skipped:
        print(f"SKIPPED: {name}")
    for name in bad:
        print(f"FAILED: {name}")
    print("{passed} passed, {failed} failed, {skipped} skipped".format(**counts))
    return 1 if bad or counts["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
